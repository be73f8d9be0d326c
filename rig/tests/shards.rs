//! Campaigns in shards: whatever the number of shards, the merged bytes are those of one run; and a merge refuses what is not whole.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The words of a campaign, and the words that put its output into a folder.
struct Campaign {
    words: Vec<String>,
    /// The files of the whole.
    files: &'static [&'static str],
}

impl Campaign {
    fn of(words: &str, files: &'static [&'static str]) -> Self {
        Self { words: words.split(' ').map(str::to_owned).collect(), files }
    }

    fn whole(&self, out: &Path) -> Output {
        rig(self.words.iter().cloned().chain(["--out".into(), out.display().to_string()]))
    }

    fn shard(&self, shard: usize, shards: usize, out: &Path) -> Output {
        let own = ["--out".into(), out.display().to_string(), "--shard".into(), format!("{shard}/{shards}")];
        rig(self.words.iter().cloned().chain(own))
    }
}

fn rig(words: impl IntoIterator<Item = String>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tractive-rig")).args(words).output().unwrap()
}

fn merge(folder: &Path, out: &Path) -> Output {
    let [folder, out] = [folder, out].map(|path| path.display().to_string());
    rig(["campaign".into(), "--merge".into(), folder, "--out".into(), out])
}

fn good(output: Output) -> String {
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{error}");
    String::from_utf8(output.stdout).unwrap()
}

/// The error of a command that must not succeed.
fn refused(output: Output) -> String {
    assert_eq!(output.status.code(), Some(2));
    String::from_utf8(output.stderr).unwrap()
}

fn bytes(folder: &Path, files: &[&str]) -> Vec<Vec<u8>> {
    files.iter().map(|name| std::fs::read(folder.join(name)).unwrap()).collect()
}

/// One in each of 1, 3 and 7 shards, and, where it leaves the files itself, as a whole.
fn merges_alike(campaign: &Campaign, has_whole: bool) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut wholes: Vec<(PathBuf, String)> = Vec::new();
    if has_whole {
        let printed = good(campaign.whole(&at("whole")));
        wholes.push((at("whole"), printed));
    }
    for shards in [1, 3, 7] {
        let (parts, out) = (at(&format!("{shards}")), at(&format!("merged-{shards}")));
        // In any order.
        for shard in (0..shards).rev() {
            good(campaign.shard(shard, shards, &parts));
        }
        let printed = good(merge(&parts, &out));
        wholes.push((out, printed));
    }
    let sentence = |(out, printed): &(PathBuf, String)| printed.replace(&out.display().to_string(), "");
    let first = bytes(&wholes[0].0, campaign.files);
    assert!(first.iter().all(|bytes| !bytes.is_empty()));
    for other in &wholes[1..] {
        assert!(bytes(&other.0, campaign.files) == first, "{}", other.0.display());
        assert_eq!(sentence(other), sentence(&wholes[0]));
    }
}

#[test]
fn faults_merge_into_the_bytes_of_one_run() {
    let files = &["campaign.csv", "summary.json", "report.html"];
    merges_alike(&Campaign::of("campaign --fast --only link- 850", files), true);
}

#[test]
fn random_runs_merge_into_the_bytes_of_one_run() {
    merges_alike(&Campaign::of("campaign --random 21 --seed 3", &["campaign.csv"]), true);
}

#[test]
fn healthy_driving_merges_into_the_same_bytes() {
    merges_alike(&Campaign::of("campaign --healthy 0.05", &["campaign.csv"]), false);
}

#[test]
fn operating_points_merge_into_the_bytes_of_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let points: Vec<_> =
        (0..23).map(|k| format!("{},{},{}\n", 40 * k, 37 * k * k % 5000, 1200 + 20 * k)).collect();
    std::fs::write(at("in.csv"), format!("torque_nm,speed_rpm,udc_v\n{}", points.concat())).unwrap();
    good(rig(["points".into(), at("in.csv"), at("out.csv")]));
    let whole = std::fs::read(at("out.csv")).unwrap();
    for shards in [1, 3, 7] {
        let parts = at(&format!("{shards}"));
        for shard in 0..shards {
            let shard = format!("{shard}/{shards}");
            good(rig(["points".into(), at("in.csv"), parts.clone(), "--shard".into(), shard]));
        }
        let out = at(&format!("merged-{shards}"));
        good(rig(["merge".into(), parts, "--out".into(), out.clone()]));
        assert!(std::fs::read(Path::new(&out).join("points.csv")).unwrap() == whole);
    }
}

/// A small campaign whose two shards are in a folder.
fn two_shards(folder: &Path) -> Campaign {
    let campaign = Campaign::of("campaign --random 6 --seed 5", &["campaign.csv"]);
    for shard in 0..2 {
        good(campaign.shard(shard, 2, folder));
    }
    campaign
}

#[test]
fn a_merge_refuses_gaps_duplicates_and_what_is_of_another_campaign() {
    let folder = tempfile::tempdir().unwrap();
    let (parts, out) = (folder.path().join("parts"), folder.path().join("out"));
    let campaign = two_shards(&parts);
    let [first, second] = [0, 1].map(|shard| parts.join(format!("shard-{shard}-of-2.csv")));
    let text = std::fs::read_to_string(&second).unwrap();
    let refuses = |new: &str, why: &str| {
        assert_ne!(new, text);
        std::fs::write(&second, new).unwrap();
        let error = refused(merge(&parts, &out));
        assert!(error.contains(why), "{error}");
        assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    };
    let without = |run: &str| -> String {
        text.lines().filter(|line| !line.starts_with(run)).flat_map(|line| [line, "\n"]).collect()
    };
    refuses(&without("3,"), "run 3 is missing; start shard 1/2 again");
    let line = text.lines().find(|line| line.starts_with("3,")).unwrap();
    refuses(&format!("{text}{line}\n"), "line 6: run 3 is there twice");
    refuses(&format!("{text}2{}\n", &line[1..]), "line 6: run 2 is none of shard 1/2 of 6 runs");
    refuses(&text.replace("\"seed\":5", "\"seed\":6"), "is of another configuration than");
    refuses(
        &text.replace("\"program\":\"", "\"program\":\"0"),
        "is of another program (commit or build) than",
    );
    refuses(
        &text.replace("\"campaign\":\"random\"", "\"campaign\":\"faults\""),
        "is of another campaign than",
    );
    refuses(&text.replace("\"runs\":6", "\"runs\":7"), "is of another number of runs than");
    refuses(&text.replace("\"shard\":1", "\"shard\":2"), "line 1: there is no shard 2/2");
    refuses("nonsense", "is no shard's file");
    std::fs::remove_file(&second).unwrap();
    assert!(refused(merge(&parts, &out)).contains("shard 1/2 is missing"));
    // Of two folders, one is not enough.
    let other = folder.path().join("other");
    good(campaign.shard(1, 2, &other));
    let of = |folders: &[&Path]| {
        let folders = folders.iter().map(|path| path.display().to_string());
        let words = ["campaign".to_owned(), "--merge".to_owned()].into_iter().chain(folders);
        rig(words.chain(["--out".to_owned(), folder.path().join("of-two").display().to_string()]))
    };
    good(of(&[&parts, &other]));
    assert!(refused(of(&[&other])).contains("shard 0/2 is missing"));
    std::fs::copy(&first, parts.join("shard-again.csv")).unwrap();
    assert!(refused(merge(&parts, &out)).contains("is shard 0/2 again"));
    std::fs::remove_file(parts.join("shard-again.csv")).unwrap();
    good(campaign.shard(1, 2, &parts));
    good(campaign.shard(2, 3, &parts));
    assert!(refused(merge(&parts, &out)).contains("is one of 3 shards"));
    assert!(!out.join("campaign.csv").exists());
}

#[test]
fn a_shard_that_was_cut_off_goes_on_and_one_that_is_done_stays() {
    let folder = tempfile::tempdir().unwrap();
    let campaign = two_shards(folder.path());
    let path = folder.path().join("shard-1-of-2.csv");
    let whole = std::fs::read_to_string(&path).unwrap();
    assert!(good(campaign.shard(1, 2, folder.path())).contains("3 runs, 3 of them there before"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), whole);
    // As it was left by a shard that was killed behind its first run.
    let cut: String = whole.lines().take(3).flat_map(|line| [line, "\n"]).collect();
    std::fs::write(&path, cut).unwrap();
    assert!(good(campaign.shard(1, 2, folder.path())).contains("3 runs, 1 of them there before"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), whole);
    let other = Campaign::of("campaign --random 6 --seed 6", &[]);
    let error = refused(other.shard(1, 2, folder.path()));
    assert!(error.contains("is of another configuration; take it away, or choose another folder"), "{error}");
}
