//! Every way a flux map can be wrong is refused, in one line that names file, line, column, value and what is allowed.
#![allow(missing_docs)]

mod common;

use common::{CoEnergy, Folder, REFERENCE, axis, good_map, good_toml};

/// The good map's lines after the comments: the header, then nodes with iq running faster.
struct Map {
    lines: Vec<String>,
}

/// Nodes of a row of the good map.
const COLUMNS: usize = 26;

impl Map {
    fn good() -> Self {
        let lines = good_map().lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect();
        Self { lines }
    }

    /// The line, from 1, of a node by its place in the grid.
    fn line(row: usize, column: usize) -> usize {
        2 + row * COLUMNS + column
    }

    /// With one field of one node replaced.
    fn with(mut self, row: usize, column: usize, field: usize, value: &str) -> Self {
        let line = &mut self.lines[Self::line(row, column) - 1];
        let mut fields: Vec<&str> = line.split(',').collect();
        fields[field] = value;
        *line = fields.join(",");
        self
    }

    fn number(&self, row: usize, column: usize, field: usize) -> f64 {
        self.lines[Self::line(row, column) - 1].split(',').nth(field).unwrap().parse().unwrap()
    }

    fn text(&self) -> String {
        self.lines.join("\n") + "\n"
    }
}

/// The error of reading a folder with this map, without the folder's path.
#[track_caller]
fn refusal(map: &str) -> String {
    let folder = Folder::new(&good_toml(), map);
    let text = folder.refusal();
    assert_eq!(text.lines().count(), 1, "{text}");
    println!("{text}");
    let prefix = format!("{}/", folder.path().display());
    text.strip_prefix(&prefix).expect("names the file").to_owned()
}

#[track_caller]
fn says(map: &str, begin: &str, allowed: &str) {
    let text = refusal(map);
    assert!(text.starts_with(begin), "{text}\nmust begin with {begin}");
    assert!(text.contains(allowed), "{text}\nmust contain {allowed}");
}

#[test]
fn the_good_map_is_accepted_with_and_without_comments_and_with_crlf() {
    Folder::new(&good_toml(), &good_map()).read().unwrap();
    let bare = Map::good().text();
    Folder::new(&good_toml(), &bare).read().unwrap();
    Folder::new(&good_toml(), &bare.replace('\n', "\r\n")).read().unwrap();
}

#[test]
fn lines_are_counted_with_comments() {
    let text = Map::good().with(3, 4, 2, "NaN").text();
    let line = Map::line(3, 4) + 2;
    let begin = format!("flux_map.csv:{line}: psi_d_wb: NaN:");
    says(&format!("# one\n# two\n{text}"), &begin, "must be a finite number");
    says(&text.replacen("\n-240,0,", "\n# one\n\n-240,0,", 1), &begin, "must be a finite number");
    let start = text[..text.find("NaN").unwrap()].rfind('\n').unwrap();
    let just_before = format!("{}\n# one\n{}", &text[..start], &text[start..]);
    says(&just_before, &begin, "must be a finite number");
    says(&just_before.replace('\n', "\r\n"), &begin, "must be a finite number");
}

#[test]
fn what_is_not_a_finite_number() {
    for value in ["NaN", "nan", "inf", "-inf", "1e999", "", "abc", "1 2", "0x10"] {
        for (field, column) in ["id_a", "iq_a", "psi_d_wb", "psi_q_wb"].into_iter().enumerate() {
            let begin = format!("flux_map.csv:{}: {column}: {value}:", Map::line(7, 9));
            says(&Map::good().with(7, 9, field, value).text(), &begin, "must be a finite number");
        }
    }
}

#[test]
fn what_no_machine_has() {
    says(
        &Map::good().with(7, 9, 3, "1e30").text(),
        "flux_map.csv:193: psi_q_wb: 1e30:",
        "must be from -1000 to 1000",
    );
    says(
        &Map::good().with(7, 9, 0, "1e30").text(),
        "flux_map.csv:193: id_a: 1e30:",
        "must be from -100000 to 100000",
    );
}

#[test]
fn headers() {
    for header in [
        "id_ka,iq_a,psi_d_wb,psi_q_wb",
        "id_a,iq_a,psi_d_mwb,psi_q_mwb",
        "id_a,iq_a,psi_d_wb",
        "iq_a,id_a,psi_d_wb,psi_q_wb",
        "-250,0,-0.494498161,0",
        "id_a;iq_a;psi_d_wb;psi_q_wb",
    ] {
        let mut map = Map::good();
        map.lines[0] = header.to_owned();
        let begin = format!("flux_map.csv:1: header: {header}:");
        says(&map.text(), &begin, "must be id_a,iq_a,psi_d_wb,psi_q_wb");
    }
    says("", "flux_map.csv", "must be id_a,iq_a,psi_d_wb,psi_q_wb");
}

#[test]
fn too_few_or_too_many_columns() {
    for line in ["-180,90,0.1", "-180,90,0.1,0.2,0.3"] {
        let mut map = Map::good();
        map.lines[Map::line(7, 9) - 1] = line.to_owned();
        let begin = format!("flux_map.csv:193: id_a,iq_a,psi_d_wb,psi_q_wb: {line}:");
        says(&map.text(), &begin, "must be four numbers");
    }
}

#[test]
fn a_missing_node() {
    let mut map = Map::good();
    map.lines.remove(Map::line(7, 9) - 1);
    says(&map.text(), "flux_map.csv:193: id_a,iq_a: -180,90:", "missing before this line");
    let mut map = Map::good();
    map.lines.pop();
    says(&map.text(), "flux_map.csv: id_a,iq_a: 50,250: missing:", "must be there");
    // An empty line is no node.
    let mut map = Map::good();
    map.lines[Map::line(7, 9) - 1] = String::new();
    says(&map.text(), "flux_map.csv:194: id_a,iq_a: -180,90:", "missing before this line");
}

#[test]
fn a_node_twice() {
    let mut map = Map::good();
    let line = map.lines[Map::line(7, 9) - 1].clone();
    map.lines.insert(Map::line(7, 9), line.clone());
    says(&map.text(), "flux_map.csv:194: id_a,iq_a: -180,90:", "duplicate of line 193: must be there once");
    let mut map = Map::good();
    map.lines.push(line);
    let begin = format!("flux_map.csv:{}: id_a,iq_a: -180,90: duplicate", map.lines.len());
    says(&map.text(), &begin, "must be there once");
    // There is one zero.
    let mut map = Map::good();
    map.lines.push(map.lines[Map::line(7, 0) - 1].replace(",0,", ",-0,"));
    let begin = format!("flux_map.csv:{}: id_a,iq_a: -180,0: duplicate", map.lines.len());
    says(&map.text(), &begin, "must be there once");
}

#[test]
fn the_order_of_the_nodes_does_not_matter() {
    let read = |map: &Map| Folder::new(&good_toml(), &map.text()).read().unwrap().map;
    let sorted = read(&Map::good());
    let mut backward = Map::good();
    backward.lines[1..].reverse();
    assert_eq!(read(&backward), sorted);
    // id running faster.
    let mut other = Map::good();
    let rows = (other.lines.len() - 1) / COLUMNS;
    let nodes = (0..COLUMNS).flat_map(|column| (0..rows).map(move |row| Map::line(row, column) - 1));
    other.lines = std::iter::once(0).chain(nodes).map(|k| Map::good().lines[k].clone()).collect();
    assert_eq!(read(&other), sorted);
    // What is wrong in it is named all the same.
    let last = other.lines.len();
    other.lines[last - 1] = other.lines[last - 2].clone();
    let begin = format!("flux_map.csv:{last}: id_a,iq_a: 40,250: duplicate of line {}:", last - 1);
    says(&other.text(), &begin, "must be there once");
    other.lines.pop();
    says(&other.text(), "flux_map.csv: id_a,iq_a: 50,250: missing:", "must be there");
}

#[test]
fn an_uneven_grid() {
    let text = REFERENCE.map(&axis(-250.0, 10.0, 31), &[0.0, 10.0, 20.0, 40.0, 120.0, 250.0]);
    says(&text, "flux_map.csv:5: iq_a: 40:", "must be 30, on an even grid of step 10");
    says(
        &Map::good().with(7, 9, 1, "91").text(),
        "flux_map.csv:193: iq_a: 91:",
        "must be 100, on an even grid",
    );
    let text = REFERENCE.map(&[-250.0, -240.0, -230.0, -210.0, -60.0, 50.0], &axis(0.0, 10.0, 26));
    says(&text, "flux_map.csv:80: id_a: -210:", "must be -220, on an even grid of step 10");
    // A step that no decimal fraction is: rounded to four digits.
    let rounded = |first: f64, count| {
        let exact = axis(first, 250.0 / 27.0, count).into_iter();
        exact.map(|value| (value * 1e4).round() / 1e4).collect::<Vec<_>>()
    };
    Folder::new(&good_toml(), &REFERENCE.map(&rounded(-250.0, 31), &rounded(0.0, 28))).read().unwrap();
}

#[test]
fn a_grid_of_too_few_nodes() {
    let text = REFERENCE.map(&axis(-250.0, 125.0, 3), &axis(0.0, 10.0, 26));
    says(&text, "flux_map.csv: id_a: 3 values:", "must be at least 4");
    says("id_a,iq_a,psi_d_wb,psi_q_wb\n", "flux_map.csv: id_a: 0 values:", "must be at least 4");
}

#[test]
fn a_grid_that_ends_before_the_largest_current() {
    let map = |id_first, id_count, iq_first, iq_count| {
        REFERENCE.map(&axis(id_first, 10.0, id_count), &axis(iq_first, 10.0, iq_count))
    };
    says(
        &map(-230.0, 29, 0.0, 26),
        "flux_map.csv: id_a: begins at -230:",
        "must begin at or below −max_current_a, -233.345",
    );
    says(&map(-250.0, 25, 0.0, 26), "flux_map.csv: id_a: ends at -10:", "must end at or above 0");
    says(
        &map(-250.0, 31, 0.0, 24),
        "flux_map.csv: iq_a: ends at 230:",
        "must end at or above max_current_a, 233.345",
    );
    says(&map(-250.0, 31, 10.0, 25), "flux_map.csv: iq_a: begins at 10:", "must begin at 0");
    says(&map(-250.0, 31, -250.0, 50), "flux_map.csv: iq_a: from -250 to 240:", "must be symmetric about 0");
    Folder::new(&good_toml(), &map(-250.0, 31, -250.0, 51)).read().expect("both signs");
    Folder::new(&good_toml(), &map(-240.0, 25, 0.0, 25)).read().expect("just enough");
}

#[test]
fn flux_that_falls_with_its_own_current() {
    let map = Map::good();
    let below = map.number(6, 9, 2);
    says(
        &map.with(7, 9, 2, &format!("{}", below - 1e-6)).text(),
        "flux_map.csv:193: psi_d_wb: ",
        "must rise with id_a, above",
    );
    let map = Map::good();
    let below = map.number(7, 8, 3);
    says(
        &map.with(7, 9, 3, &format!("{below}")).text(),
        "flux_map.csv:193: psi_q_wb: ",
        "must rise with iq_a, above",
    );
}

#[test]
fn a_map_that_is_not_even_in_iq() {
    let (id, iq) = (axis(-250.0, 10.0, 31), axis(-250.0, 10.0, 51));
    let lean = |d_share: f64, q_offset: f64| {
        let mut text = String::from("id_a,iq_a,psi_d_wb,psi_q_wb\n");
        for d in &id {
            for q in &iq {
                let (psi_d, psi_q) = REFERENCE.flux(*d, *q);
                text += &format!("{d},{q},{},{}\n", psi_d + d_share * q / 250.0, psi_q + q_offset);
            }
        }
        text
    };
    Folder::new(&good_toml(), &lean(0.0, 0.0)).read().unwrap();
    Folder::new(&good_toml(), &lean(0.002, 0.002)).read().expect("a little is measurement");
    says(&lean(0.05, 0.0), "flux_map.csv:2: psi_d_wb: ", "the mirror image of line 52");
    says(&lean(0.0, 0.05), "flux_map.csv:2: psi_q_wb: ", "the mirror image of line 52");
    // Of one sign only, ψq must be 0 at iq = 0.
    let mut map = Map::good();
    for row in 0..31 {
        map = map.with(row, 0, 3, "0.05");
    }
    says(&map.text(), "flux_map.csv:2: psi_q_wb: 0.05:", "at iq = 0");
}

#[test]
fn cross_terms_that_do_not_agree() {
    // ψd sees none of the saturation by iq that ψq has.
    let mut text = String::from("id_a,iq_a,psi_d_wb,psi_q_wb\n");
    for d in axis(-250.0, 10.0, 31) {
        for q in axis(0.0, 10.0, 26) {
            text += &format!("{d},{q},{},{}\n", REFERENCE.flux(d, 0.0).0, REFERENCE.flux(d, q).1);
        }
    }
    says(&text, "flux_map.csv:", "must agree within");
}

#[test]
fn a_map_with_two_currents_for_one_flux_linkage() {
    // ψd rises along id, ψq along iq, and the cross terms agree, yet they win over the self inductances.
    let flux = |d: f64, q: f64| (0.3 + 0.0005 * d + 1e-5 * q * q, 0.022 * q + 2e-5 * d * q);
    let mut text = String::from("id_a,iq_a,psi_d_wb,psi_q_wb\n");
    for d in axis(-250.0, 10.0, 31) {
        for q in axis(0.0, 10.0, 26) {
            let (psi_d, psi_q) = flux(d, q);
            text += &format!("{d},{q},{psi_d},{psi_q}\n");
        }
    }
    says(&text, "flux_map.csv:", "must be below that of the self inductances");
}

#[test]
fn a_map_with_d_and_q_the_other_way_round() {
    // A reluctance machine with d along its lower reluctance: its best point has id > 0.
    let machine = CoEnergy { psi_m_wb: 0.0, ..common::linear(0.02, 0.004, 0.0) };
    let map = machine.map(&axis(-250.0, 10.0, 31), &axis(0.0, 10.0, 26));
    let folder = Folder::new(&good_toml(), &map);
    let text = folder.refusal();
    assert!(
        text.contains("max_torque_nm: 1235: must be reachable with least current at id up to 50"),
        "{text}"
    );
    assert!(text.contains("d must lie along the magnets"), "{text}");
}

#[test]
fn a_file_that_cannot_be_read() {
    let folder = Folder::new(&good_toml(), "");
    std::fs::remove_file(folder.path().join("flux_map.csv")).unwrap();
    let text = folder.refusal();
    assert!(text.contains("flux_map.csv: cannot be read: "), "{text}");
    std::fs::write(folder.path().join("flux_map.csv"), b"id_a,iq_a,psi_d_wb,psi_q_wb\n\xff,0,0,0\n").unwrap();
    let text = folder.refusal();
    assert!(text.contains("flux_map.csv:2: "), "{text}");
}
