//! The refusals of the build script: each key of a power stage by its name and line, and each machine that the stage does not suit.

#[path = "../build/power_stage/mod.rs"]
mod power_stage;

use nucleo_g474re::built_in::{traction, zs9};
use nucleo_g474re::{dead_time, rates, zs9::rates as zs9_rates};
use power_stage::Machine;
use std::path::Path;
use tractive::control::Gains;
use tractive::machine::{Ratings, Tables};

/// A system's stage as it is delivered.
#[derive(Clone, Copy)]
struct Delivered {
    file: &'static str,
    text: &'static str,
    tables: &'static Tables,
    check: fn(&Path, &str, &Machine) -> Result<String, tractive_tablegen::InputError>,
}

const TRACTION: Delivered = Delivered {
    file: "power_stage.toml",
    text: include_str!("../power_stage.toml"),
    tables: &traction::BUILT_IN,
    check: power_stage::traction,
};

const ZS9: Delivered = Delivered {
    file: "power_stage_zs9.toml",
    text: include_str!("../power_stage_zs9.toml"),
    tables: &zs9::BUILT_IN,
    check: power_stage::zs9,
};

impl Delivered {
    fn check(&self, text: &str, tables: &Tables) -> Result<String, String> {
        let machine = Machine { folder: Path::new("machine"), tables, carrier_share: 1.0 };
        (self.check)(Path::new(self.file), text, &machine).map_err(|error| error.to_string())
    }

    /// The line of a key, from 1.
    fn line(&self, key: &str) -> usize {
        let is_key = |line: &str| line.split_once(" =").is_some_and(|(word, _)| word == key);
        self.text.lines().position(is_key).unwrap_or_else(|| panic!("no {key}")) + 1
    }

    /// With another value for a key.
    fn with(&self, key: &str, value: &str) -> String {
        let mut lines: Vec<_> = self.text.lines().map(str::to_owned).collect();
        lines[self.line(key) - 1] = format!("{key} = {value}");
        lines.join("\n")
    }

    /// The error of this value; it names file, line and key.
    fn refused(&self, key: &str, value: &str) -> String {
        let said = self
            .check(&self.with(key, value), self.tables)
            .expect_err(&format!("{key} = {value} is let through"));
        let start = format!("{}:{}: ", self.file, self.line(key));
        said.strip_prefix(&start).unwrap_or_else(|| panic!("{key} = {value}: {said}")).to_owned()
    }

    /// The error of this machine.
    fn refused_machine(&self, spoil: fn(&mut Ratings)) -> String {
        let mut tables = *self.tables;
        spoil(&mut tables.ratings);
        self.check(self.text, &tables).expect_err("is let through")
    }
}

/// All keys of a file, those of its tables among them.
fn keys(table: &toml::Table) -> Vec<(String, toml::Value)> {
    let of = |(key, value): (&String, &toml::Value)| match value {
        toml::Value::Table(table) => keys(table),
        value => vec![(key.clone(), value.clone())],
    };
    table.iter().flat_map(of).collect()
}

#[test]
fn every_key_is_refused_by_name_and_line() {
    for stage in [TRACTION, ZS9] {
        stage.check(stage.text, stage.tables).unwrap();
        let keys = keys(&stage.text.parse().unwrap());
        assert!(keys.len() > 10);
        for (key, value) in keys {
            let nonsense: &[&str] = match value {
                toml::Value::Integer(_) => &["0", "4294967295", "-1", "1.5"],
                toml::Value::Float(_) if key == "angle_late_us" => &["nan", "inf", "-501.0", "501.0"],
                toml::Value::Float(_) => &["0.0", "nan", "inf", "-1.0", "1e9"],
                _ => &["[]", "[nan]", "[nan, 0.0]", "[0.0, 1e9]", "[0.0, 0.0, 0.0]"],
            };
            for bad in nonsense {
                let said = stage.refused(&key, bad);
                // A value that is no such number is refused by the parser, which names the line alone.
                assert!(
                    said.starts_with(&format!("{key}: ")) || said.starts_with("invalid "),
                    "{key} = {bad}: {said}"
                );
            }
            let without: Vec<_> =
                stage.text.lines().filter(|line| !line.starts_with(&format!("{key} ="))).collect();
            let said = stage.check(&without.join("\n"), stage.tables).expect_err(&key);
            assert!(said.contains(&key) && said.contains("missing"), "{said}");
        }
        let unknown = format!("anything = 1\n{}", stage.text);
        let said = stage.check(&unknown, stage.tables).unwrap_err();
        assert!(said.starts_with(&format!("{}:1: unknown field `anything`", stage.file)), "{said}");
    }
}

#[test]
fn an_index_counts_at_the_state_of_the_tracks_that_is_told() {
    let with = |text: &str, more: &str| TRACTION.check(&format!("{more}\n{text}"), TRACTION.tables);
    assert!(TRACTION.check(TRACTION.text, TRACTION.tables).unwrap().contains("encoder_index_ab: 0,"));
    for (text, index) in [(TRACTION, "0b11"), (ZS9, "3")] {
        let constant =
            text.check(&format!("encoder_index_ab = {index}\n{}", text.text), text.tables).unwrap();
        assert!(constant.contains("encoder_index_ab: 3,"), "{constant}");
    }
    let said = with(TRACTION.text, "encoder_index_ab = 4").unwrap_err();
    assert!(said.contains("encoder_index_ab: 4: must be from 0 to 3: two bits"), "{said}");
    let said = with(ABSOLUTE, "encoder_index_ab = 0b01").unwrap_err();
    assert!(said.contains("encoder_index_ab: this sensor has no index"), "{said}");
}

#[test]
fn a_known_filter_and_known_drops_are_made_up_for() {
    let with = |more: &str| TRACTION.check(&format!("{more}\n{}", TRACTION.text), TRACTION.tables);
    let constant =
        with("current_filter_us = 100.0\ndevice_threshold_v = 1.75\ndevice_slope_mohm = 4.0").unwrap();
    assert!(constant.contains("current_filter_s: 0.0001,"), "{constant}");
    assert!(constant.contains("drops: Drops { threshold_v: 1.75, slope_ohm: 0.004 },"), "{constant}");
    for (bad, told) in [
        ("current_filter_us = 120.0", "current_filter_us: 120: must be from 0 to 119"),
        ("device_threshold_v = 21.0", "device_threshold_v: 21: must be from 0 to 20"),
        ("device_slope_mohm = nan", "device_slope_mohm: NaN: must be from 0 to 150"),
    ] {
        let said = with(bad).unwrap_err();
        assert!(said.contains(told), "{said}");
        let said = ZS9.check(&format!("{bad}\n{}", ZS9.text), ZS9.tables).unwrap_err();
        assert!(said.contains("the control of two motors"), "{said}");
    }
}

const ABSOLUTE: &str = include_str!("../power_stage_absolute.toml");
const BISS: &str = include_str!("../power_stage_biss.toml");
const RESOLVER: &str = include_str!("../power_stage_resolver.toml");

#[test]
fn another_position_sensor_takes_the_encoders_place() {
    let machine = Machine { folder: Path::new("machine"), tables: TRACTION.tables, carrier_share: 1.0 };
    let sensor = |text: &str| {
        power_stage::sensor(Path::new(TRACTION.file), text, &machine).map_err(|error| error.to_string())
    };
    for (text, kind, counts, late_s) in [
        (TRACTION.text.to_owned(), "Encoder", 4_096, 0.0),
        (ABSOLUTE.to_owned(), "Absolute<17, true>", 131_072, 1e-4),
        (BISS.to_owned(), "Biss<18, 0>", 262_144, 1e-4),
        // 1 V of 1.65 V are 1,241 codes; 40 µs at 21.25 MHz 850 ticks.
        (RESOLVER.to_owned(), "Resolver<4, 1241, 850>", 65_536, 5e-5),
    ] {
        assert!(sensor(&text).unwrap().contains(&format!("pub type Sensor = {kind};")), "{kind}");
        let constant = TRACTION.check(&text, TRACTION.tables).unwrap();
        assert!(constant.contains(&format!("encoder_counts: {counts},")), "{constant}");
        assert!(constant.contains(&format!("angle_late_s: {late_s:?},")), "{constant}");
    }
    for (text, key, bad, told) in [
        (ABSOLUTE, "bits = 17", "bits = 25", "bits: 25: must be from 8 to 24: of one turn"),
        (ABSOLUTE, "gray = true", "gray = 1", "invalid type"),
        (BISS, "bits = 18", "bits = 7", "bits: 7: must be from 8 to 26: of one turn"),
        (
            BISS,
            "turns_bits = 0",
            "turns_bits = 15",
            "turns_bits: 15: must be from 0 to 14: 32 with those of one turn",
        ),
        (RESOLVER, "pole_pairs = 1", "pole_pairs = 3", "pole_pairs: 3: must divide the machine's 4"),
        (RESOLVER, "pole_pairs = 1", "pole_pairs = 8", "pole_pairs: 8: must be from 1 to 4"),
        (RESOLVER, "amplitude_v = 1.0", "amplitude_v = 1.3", "amplitude_v: 1.3: must be from 0.2 to 1.237"),
        (
            RESOLVER,
            "lag_us = 10.0",
            "lag_us = 31.0",
            "lag_us: 31: must be from 0 to 30: of filter and resolver",
        ),
    ] {
        let said = sensor(&text.replace(key, bad)).unwrap_err();
        assert!(said.contains(told), "{said}");
    }
    let quick = RESOLVER.replace("control_hz = 10000", "control_hz = 25000");
    assert!(sensor(&quick).unwrap_err().contains("control_hz: 25000: must be from 4000 to 20000"));
    for frames in [ABSOLUTE, BISS] {
        let quick = frames.replace("control_hz = 10000", "control_hz = 25000");
        assert!(sensor(&quick).unwrap_err().contains("control_hz: 25000: must be from 0 to 22000"));
    }
    let late = ABSOLUTE.replace("angle_late_us = 0.0", "angle_late_us = 401.0");
    let said = TRACTION.check(&late, TRACTION.tables).unwrap_err();
    assert!(said.contains("angle_late_us: 401: must be from -500 to 400"), "{said}");
    let table = |text: &'static str| text.split_once("\n[").map(|(_, table)| format!("\n[{table}")).unwrap();
    for both in [TRACTION.text.to_owned() + &table(ABSOLUTE), ABSOLUTE.to_owned() + &table(RESOLVER)] {
        let said = sensor(&both).unwrap_err();
        assert!(said.contains("one of encoder_counts, absolute, biss, resolver"), "{said}");
    }
    for (text, key) in [(BISS, "biss"), (RESOLVER, "resolver")] {
        let said = ZS9.check(&(ZS9.text.to_owned() + &table(text)), ZS9.tables).unwrap_err();
        assert!(said.contains(&format!("{key}: the ZS9's board reads encoders that count")), "{said}");
    }
}

#[test]
fn a_small_machine_needs_small_comparators() {
    let mut small = *TRACTION.tables;
    (small.ratings.max_current_a, small.ratings.trip_current_a) = (30.0, 39.0);
    let said = TRACTION.check(TRACTION.text, &small).unwrap_err();
    assert_eq!(
        said,
        format!(
            "power_stage.toml:{}: break_current_a: 450: must be from 54.625 to 78: above the machine's trip_current_a, 39, by a sensor's \
             offset, and at most twice it",
            TRACTION.line("break_current_a")
        )
    );
    for (break_a, told) in
        [("54.0", "break_current_a: 54:"), ("79.0", "break_current_a: 79:"), ("60.0", "would not start")]
    {
        // 60 A suit; the drive itself refuses a map that is far larger than its machine.
        let said = TRACTION.check(&TRACTION.with("break_current_a", break_a), &small).unwrap_err();
        assert!(said.contains(told), "{said}");
    }
    // Below that the converters resolve nothing.
    small.ratings.trip_current_a = 24.0;
    let said = TRACTION.check(&TRACTION.with("break_current_a", "46.0"), &small).unwrap_err();
    assert!(said.contains("current_range_a: 500: must be from 24.799 to 480"), "{said}");
}

#[test]
fn another_machine_is_built_once_the_comparators_suit_it() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/own-board/machine");
    let tables = tractive_tablegen::MachineFolder::read(&folder).unwrap().tables();
    let said = TRACTION.check(TRACTION.text, &tables).unwrap_err();
    assert!(said.contains("break_current_a: 450: must be from 93.625 to 156"), "{said}");
    let constant = TRACTION.check(&TRACTION.with("break_current_a", "120.0"), &tables).unwrap();
    assert!(constant.contains("break_current_a: 120.0"), "{constant}");
}

/// The same machine from 48 V, whose devices switch at 20 kHz.
#[test]
fn the_control_rate_suits_the_carrier_the_timers_and_the_processor() {
    let said = TRACTION.refused("control_hz", "800");
    assert!(
        said.starts_with("control_hz: 800: must be from 1100 to 29701: the machine's max_switching_hz"),
        "{said}"
    );
    assert!(
        TRACTION.refused("control_hz", "40000").starts_with("control_hz: 40000: must be from 1100 to 29701")
    );
    let said = TRACTION.refused("control_hz", "12000");
    assert_eq!(said, "control_hz: 12000: must be a whole part of 170000000 Hz");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/own-board/machine");
    let mut quick = tractive_tablegen::MachineFolder::read(&folder).unwrap().tables();
    quick.ratings.max_switching_hz = 20_000.0;
    let text =
        TRACTION.with("break_current_a", "120.0").replace("min_pulse_ns = 15000", "min_pulse_ns = 8000");
    let said = TRACTION.check(&text, &quick).unwrap_err();
    assert!(said.contains("control_hz: 10000: must be from 20000 to 25391"), "{said}");
    const PAGE: &str = include_str!("../../../docs/nucleo-g474re.md");
    assert!(PAGE.contains("(29,701 with 900 Hz, 25,391 with 20 kHz)"), "the page says other rates");
    let constant = TRACTION.check(&text.replace("control_hz = 10000", "control_hz = 20000"), &quick).unwrap();
    assert!(constant.contains("control_hz: 20000,"), "{constant}");
    for (control_hz, prescaler, ticks_per_s) in [(10_000, 8, 21_250_000), (20_000, 5, 34_000_000)] {
        let clock = rates::clock(control_hz);
        assert_eq!(rates::prescaler(control_hz), prescaler);
        assert_eq!((clock.ticks_per_s as u32, clock.control_ticks), (ticks_per_s, ticks_per_s / control_hz));
    }
    let said = ZS9.check(&format!("angle_late_us = 1.0\n{}", ZS9.text), ZS9.tables).unwrap_err();
    assert!(said.contains("angle_late_us: the control of two motors"), "{said}");
    let said = ZS9.check(&format!("control_hz = 20000\n{}", ZS9.text), ZS9.tables).unwrap_err();
    assert!(said.starts_with("power_stage_zs9.toml:1: control_hz: the control of two motors"), "{said}");
}

/// The drive damps a link behind a line filter, and the processor's time for it is reckoned.
#[test]
fn a_line_filter_is_a_key_of_the_stage() {
    let text = TRACTION.with("behind_line_filter", "true");
    let constant = TRACTION.check(&text, TRACTION.tables).unwrap();
    assert!(constant.contains("behind_line_filter: true,"), "{constant}");
    let settings = |behind| rates::settings(10_000, 15_000, 5_000, 900.0, behind).gains;
    assert_eq!(settings(true), Gains::of(false, true));
    assert_eq!(settings(false), Gains::DEFAULT);
    let said = TRACTION.check(&text.replace("control_hz = 10000", "control_hz = 40000"), TRACTION.tables);
    let said = said.unwrap_err();
    assert!(said.contains("control_hz: 40000: must be from 1100 to 28766"), "{said}");
    let constant = ZS9.check(&ZS9.with("behind_line_filter", "true"), ZS9.tables).unwrap();
    assert!(constant.contains("behind_line_filter: true,"), "{constant}");
    let said = ZS9.check(&ZS9.text.replace("behind_line_filter", "# "), ZS9.tables).unwrap_err();
    assert!(said.contains("behind_line_filter: is missing"), "{said}");
    let conductance_s = |behind| zs9_rates::settings(ZS9.tables, behind).link.damping_s;
    assert_eq!((conductance_s(false), conductance_s(true)), (0.0, 2.0 * 2.0 * 12.57e3 / 160e3));
}

/// The stage of extra-low voltage suits its machine, and the other one does not.
#[test]
fn the_stage_of_48_volts_suits_the_machine_of_48_volts() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tables/pmsm-48v-1kw");
    let tables = tractive_tablegen::MachineFolder::read(&folder).unwrap().tables();
    let low =
        Delivered { file: "power_stage_48v.toml", text: include_str!("../power_stage_48v.toml"), ..TRACTION };
    let constant = low.check(low.text, &tables).unwrap();
    for told in ["control_hz: 20000,", "dead_time_ns: 200,", "udc_v_per_code: 80.0 / 4095.0"] {
        assert!(constant.contains(told), "{constant}");
    }
    let said = low.check(low.text, TRACTION.tables).unwrap_err();
    assert!(said.contains("max_switching_hz: 900: must be at least 1038"), "{said}");
    let said = TRACTION.check(TRACTION.text, &tables).unwrap_err();
    assert!(said.contains("control_hz: 10000: must be from 20000 to 25391"), "{said}");
}

/// The cycles that the control rate is checked with are no fewer than those that were counted.
#[test]
fn the_processors_time_is_what_the_page_of_costs_says() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/cost.md");
    let text = std::fs::read_to_string(page).unwrap();
    for (interrupt, column, cycles) in [("control", 5, rates::CONTROL_CYCLES), ("pwm", 8, rates::PWM_CYCLES)]
    {
        let rows =
            text.lines().filter(|line| line.starts_with("| pmasynrm |") && line.matches('|').count() == 11);
        let counted =
            rows.filter_map(|row| row.split('|').nth(column)?.trim().parse::<u32>().ok()).max().unwrap();
        assert!(
            (counted..counted + 200).contains(&cycles),
            "{interrupt}: {counted} cycles, reckoned with {cycles}"
        );
    }
}

#[test]
fn a_large_machine_needs_large_sensors_and_comparators() {
    let said = TRACTION.refused_machine(|ratings| ratings.trip_current_a = 600.0);
    assert!(
        said.contains("current_range_a: 500: must be from 619.98 to 12000: the machine's trip_current_a"),
        "{said}"
    );
    let said = TRACTION.refused_machine(|ratings| ratings.trip_current_a = 440.0);
    assert!(said.contains("break_current_a: 450: must be from 455.625 to 880"), "{said}");
    // Beyond what the converters hold with a zero that is off.
    let said = TRACTION.refused("break_current_a", "490.0");
    assert!(said.starts_with("break_current_a: 490: must be from 0 to 483.887"), "{said}");
    let said = ZS9.refused_machine(|ratings| ratings.trip_current_a = 128.0);
    assert!(said.contains("break_current_a: 130: must be from 132.688 to 256"), "{said}");
    let said = TRACTION.refused_machine(|ratings| ratings.trip_dc_over_v = 2_500.0);
    assert!(
        said.contains("dc_link_range_v: 2500: must be from 2500.611 to 50000: the machine's trip_dc_over_v"),
        "{said}"
    );
}

#[test]
fn times_suit_each_other_the_timers_and_the_carrier() {
    for (key, value) in [
        // The generator makes 5,036 ns of 5 µs: such a pulse would vanish.
        ("min_pulse_ns", "5036"),
        ("min_pulse_ns", "4000"),
        // Half of the shortest carrier half is 278 µs.
        ("min_pulse_ns", "280000"),
        ("dead_time_ns", "23718"),
    ] {
        let said = TRACTION.refused(key, value);
        assert!(said.starts_with("min_pulse_ns: ") || said.starts_with("dead_time_ns: "), "{said}");
    }
    TRACTION.check(&TRACTION.with("min_pulse_ns", "5037"), TRACTION.tables).unwrap();
    let said = TRACTION.check(&TRACTION.with("dead_time_ns", "14995"), TRACTION.tables).unwrap_err();
    assert!(said.contains("min_pulse_ns: 15000: must be from 15060 "), "{said}");
    assert!(ZS9.refused("dead_time_ns", "5001").starts_with("dead_time_ns: 5001: must be from 1 to 5000"));
    let said = TRACTION.refused_machine(|ratings| ratings.max_switching_hz = 600.0);
    assert!(said.starts_with("machine/machine.toml: max_switching_hz: 600: must be at least 649"), "{said}");
    let mut slowest = *TRACTION.tables;
    slowest.ratings.max_switching_hz = 649.0;
    TRACTION.check(TRACTION.text, &slowest).unwrap();
}

#[test]
fn the_zs9s_own_scales_suit_its_link() {
    assert!(ZS9.refused("dc_link_range_v", "720.0").contains("the capacitors' highest voltage"));
    assert!(ZS9.refused("inductor_range_a", "90.0").contains("the inductor's highest current"));
    assert!(ZS9.refused("source_range_v", "600.0").contains("the source's highest voltage"));
    assert!(ZS9.refused("link_ref_v", "390.0").starts_with("link_ref_v: 390: must be from 39"));
    let said = ZS9.check(&format!("min_pulse_ns = 1\n{}", ZS9.text), ZS9.tables).unwrap_err();
    assert!(said.starts_with("power_stage_zs9.toml:1: min_pulse_ns: "), "{said}");
    let said = TRACTION.check(ZS9.text, TRACTION.tables).unwrap_err();
    assert!(said.contains("z_source: is the ZS9's"), "{said}");
}

/// The drive's own check has the last word, as it would have at the start.
#[test]
fn a_machine_that_the_image_would_refuse_is_not_built() {
    for stage in [TRACTION, ZS9] {
        let said = stage.refused_machine(|ratings| ratings.max_current_a = 2.0 * ratings.trip_current_a);
        assert!(
            said.starts_with("machine/machine.toml: the image would not start: ratings.max_current_a: "),
            "{said}"
        );
        let said = stage.refused_machine(|ratings| ratings.pole_pairs = 2.5);
        assert!(
            said.starts_with("machine/machine.toml: the image would not start: ratings.pole_pairs: 2.5"),
            "{said}"
        );
    }
}

/// Temperature sensors and thermal data as the guide has them.
fn thermal() -> String {
    let guide = include_str!("../../../docs/nucleo-g474re.md");
    let (_, from) = guide.split_once("```toml\n[thermal]").expect("a table");
    let (keys, _) = from.split_once("```").expect("its end");
    format!("{}\n[thermal]{keys}", TRACTION.text)
}

#[test]
fn temperature_sensors_are_taken_as_the_guide_has_them() {
    let none = TRACTION.check(TRACTION.text, TRACTION.tables).unwrap();
    assert!(none.contains("thermal: None,"), "{none}");
    let some = TRACTION.check(&thermal(), TRACTION.tables).unwrap();
    for part in [
        "thermal: Some(Thermal { winding_sensor: Sensor { element: Pt1000, series_ohm: 1000.0, range_c: [-40.0, 220.0] }",
        "element: Ntc { at_25_ohm: 10000.0, beta_k: 3435.0 }",
        "resistance_ohm: 0.1,",
        "winding_derating: Derating { from_c: 140.0, none_c: 160.0 }, winding_trip_c: 175.0",
        "magnets: Some(Magnets { per_k: -0.001, map_c: 20.0,",
    ] {
        assert!(some.contains(part), "{part}: {some}");
    }
}

#[test]
fn thermal_data_that_makes_no_sense_are_refused_by_name() {
    let text = thermal();
    for (good, bad, name) in [
        ("[140.0, 160.0, 175.0]", "[140.0, 160.0, 150.0]", "thermal.winding_trip_c"),
        ("[140.0, 160.0, 175.0]", "[170.0, 160.0, 175.0]", "thermal.derating.from_c"),
        ("series_ohm = 1000.0", "series_ohm = 0.0", "thermal.sensor.series_ohm"),
        ("[10000.0, 3435.0]", "[10000.0, 0.0]", "thermal.sensor.beta_k"),
        ("series_ohm = 1000.0", "serial_ohm = 1000.0", "serial_ohm"),
    ] {
        assert!(text.contains(good), "{good}");
        let said = TRACTION.check(&text.replacen(good, bad, 1), TRACTION.tables).expect_err(bad);
        assert!(said.contains(name), "{said}");
    }
    let (_, keys) = text.split_once("[thermal]").unwrap();
    let said = ZS9.check(&format!("{}\n[thermal]{keys}", ZS9.text), ZS9.tables).expect_err("of the ZS9");
    assert!(said.contains("the ZS9 knows no temperatures"), "{said}");
}
