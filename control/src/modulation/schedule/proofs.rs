//! Proofs of the choice of mode, by every cell of the arrangement of its borders.
//!
//! The choice compares the frequency and the modulation index with the ladder's borders, and looks at nothing else. So it is the same
//! throughout a cell between the borders, and a few numbers stand for all of them: each border as the first number that is not
//! below it, both its neighbours, one number between two borders, and all numbers that are not ordinary. Borders of the
//! index that are lowered by the shortest pulse depend on the frequency: where two of them cross, the frequency has a border too.
//!
//! Each proof holds for pulses of any shortest length that [`SHORTEST`] brackets by examples.

extern crate std;

use super::*;
use std::collections::BTreeMap;
use std::sync::OnceLock;
use std::vec::Vec;

const CLOCK: Clock = Clock::new(25_000_000, 2_500);
const LINK_V: f32 = 1_500.0;

/// Shortest pulses, in ticks: none, 10 µs, 40 µs.
const SHORTEST: [u32; 3] = [0, 250, 1_000];

/// Numbers that are not ordinary, and the ends of those that are.
const SPECIAL: [f32; 10] = [
    f32::NAN,
    f32::NEG_INFINITY,
    f32::MIN,
    -1e-3,
    -0.0,
    0.0,
    f32::from_bits(1),
    f32::MIN_POSITIVE,
    f32::MAX,
    f32::INFINITY,
];

/// The first number from 0 up to `most` that a rule holds for, which holds from there on.
fn first(most: f32, holds: impl Fn(f32) -> bool) -> f32 {
    let (mut low, mut high) = (0, most.to_bits());
    while low < high {
        let middle = low + (high - low) / 2;
        (low, high) = if holds(f32::from_bits(middle)) { (low, middle) } else { (middle + 1, high) };
    }
    f32::from_bits(low)
}

/// A number for every cell between these borders.
fn cells(mut borders: Vec<f32>) -> Vec<f32> {
    borders.retain(|border| border.is_finite());
    borders.sort_by(f32::total_cmp);
    borders.dedup();
    let between = borders.windows(2).map(|pair| pair[0] + 0.5 * (pair[1] - pair[0]));
    let around = borders.iter().flat_map(|border| [border.next_down(), *border, border.next_up()]);
    between.chain(around).chain(SPECIAL).collect()
}

/// The borders that a number has passed on the way up and on the way down, a bit for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Passed {
    up: u32,
    down: u32,
}

impl Passed {
    fn of(value: f32, borders: impl Iterator<Item = (f32, f32)>) -> Self {
        let bit = |is_passed: bool, place: usize| u32::from(is_passed) << place;
        borders.enumerate().fold(Self { up: 0, down: 0 }, |all, (place, (up, down))| Self {
            up: all.up | bit(value >= up, place),
            down: all.down | bit(value >= down, place),
        })
    }

    /// `true` if from one number to the other a border's whole hysteresis is passed.
    const fn spans(self, other: Self) -> bool {
        self.up & !other.down | other.up & !self.down != 0
    }

    /// `true` if it has passed all that the other one has.
    const fn includes(self, other: Self) -> bool {
        other.up & !self.up | other.down & !self.down == 0
    }
}

/// A cell: the outcomes of all comparisons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Cell {
    share: Passed,
    index: Passed,
    /// That of the modulation index that is made; `None` if it is NaN.
    made: Option<Passed>,
}

impl Cell {
    fn spans(&self, other: &Self) -> bool {
        let made = match (self.made, other.made) {
            (Some(one), Some(other)) => one.spans(other),
            (one, other) => one != other,
        };
        self.share.spans(other.share) || self.index.spans(other.index) || made
    }
}

/// A ladder with its devices.
#[derive(Clone, Copy)]
struct Case {
    ladder: Ladder,
    devices: SwitchLimits,
}

impl Case {
    fn new(ladder: Ladder, min_pulse_ticks: u32) -> Self {
        Self { ladder, devices: SwitchLimits::new(min_pulse_ticks, 0, 900.0, &CLOCK) }
    }

    /// Every case. No shortest pulse moves a border of the optimised patterns.
    fn all() -> Vec<Self> {
        let ladders = [Ladder::PAPER, Ladder::of(&[Mode::Sync12]), Ladder::of(&[])];
        let on = |ladder: &Ladder| SHORTEST.map(|ticks| Self::new(*ladder, ticks));
        let optimal = [
            #[cfg(feature = "optimal")]
            Self::new(Ladder::OPTIMAL, SHORTEST[1]),
        ];
        ladders.iter().flat_map(on).chain(optimal).collect()
    }

    /// `true` if a mode of the ladder may have to come down because less voltage is made than the operating point asks for.
    fn is_optimal(&self) -> bool {
        self.ladder.modes().any(Mode::is_optimal)
    }

    fn schedule(&self) -> Schedule {
        Schedule::on(self.ladder, &CLOCK)
    }

    /// The ladder's modes, those that catch a machine, and one that is not on it.
    fn modes(&self) -> Vec<Mode> {
        let mut modes: Vec<_> = self.ladder.modes().collect();
        for other in [Mode::Mid3, Mode::Square, Mode::Mid5] {
            if !modes.contains(&other) {
                modes.push(other);
            }
        }
        modes
    }

    /// Shares of the frequency's borders, up and down. NaN, too, passes the free carrier's.
    fn shares(&self) -> impl Iterator<Item = (f32, f32)> {
        self.ladder.modes().map(|mode| mode.row().until.shares)
    }

    /// The index's borders of each locked mode, up and down, at an angular speed in angle units per tick.
    fn indices(&self, rate: f32) -> impl Iterator<Item = (f32, f32)> {
        let notch = shortest_notch(rate, &self.devices);
        self.ladder.modes().skip(1).map(move |mode| reached(mode.row(), notch))
    }

    fn share(&self, rate: f32) -> f32 {
        share(&Reference { rate, ..Reference::NONE }, &self.devices)
    }

    /// The index compared with the borders: a floor that rises with the frequency lifts the one of optimised patterns.
    #[cfg(feature = "optimal")]
    fn index(&self, seen: &Reference) -> f32 {
        self.schedule().filled_index(seen, &self.devices)
    }

    /// The index compared with the borders.
    #[cfg(not(feature = "optimal"))]
    fn index(&self, seen: &Reference) -> f32 {
        seen.modulation_index
    }

    /// Every rate that stands for a cell.
    fn rates(&self) -> Vec<f32> {
        let sides = self.shares().flat_map(|(up, down)| [up, down]);
        let mut rates: Vec<_> =
            sides.map(|side| first(f32::INFINITY, |rate| self.share(rate) >= side)).collect();
        // The largest rate at which the shortest pulse is less than an angle of 1 rad: far beyond the last border of the frequency.
        let most = 2.0 * UNITS_PER_RADIAN / (self.devices.min_pulse_ticks as f32 + 1.0);
        assert!(self.share(most) > 2.0);
        let sides = |rate: f32| self.indices(rate).flat_map(|(up, down)| [up, down]).collect::<Vec<_>>();
        let fixed = sides(0.0);
        let lowered = (0..fixed.len()).map(|side| first(most, |rate| sides(rate)[side] != fixed[side]));
        rates.extend(lowered);
        rates.extend([0.0, most]);
        rates.sort_by(f32::total_cmp);
        let spans: Vec<[f32; 2]> = rates.windows(2).map(|pair| [pair[0], pair[1]]).collect();
        for span in spans.into_iter().filter(|[_, end]| *end <= most) {
            rates.extend(crossings(span, fixed.len(), sides));
        }
        cells(rates)
    }

    /// Every voltage that stands for a cell of the index that is made.
    fn voltages(&self) -> Vec<f32> {
        if !self.is_optimal() {
            return std::vec![0.0];
        }
        let sides = self.indices(0.0).flat_map(|(up, down)| [up, down]).filter(|side| side.is_finite());
        let mut borders: Vec<_> = sides.map(|side| first(f32::MAX, |volts| made(volts) >= side)).collect();
        borders.push(0.0);
        cells(borders)
    }

    fn cell(&self, seen: &Reference) -> Cell {
        let made = made(seen.voltage_v);
        let mut share = Passed::of(self.share(seen.rate), self.shares());
        if seen.rate.is_nan() {
            (share.up, share.down) = (1, 1);
        }
        Cell {
            share,
            index: Passed::of(self.index(seen), self.indices(seen.rate)),
            made: (!made.is_nan()).then(|| Passed::of(made, self.indices(0.0))),
        }
    }

    /// The choice in every cell, out of each of [`Case::modes`] long after the last switch, with a reference of the cell. It is asserted
    /// that nothing but the cell decides.
    fn choices(&self) -> Vec<Choice> {
        let (modes, voltages) = (self.modes(), self.voltages());
        let mut choices = BTreeMap::<Cell, Choice>::new();
        for rate in self.rates() {
            let borders = self.indices(rate).flat_map(|(up, down)| [up, down]);
            let indices = cells(borders.chain([0.5]).collect());
            for (modulation_index, volts) in indices
                .iter()
                .flat_map(|modulation_index| voltages.iter().map(move |v| (*modulation_index, *v)))
            {
                let seen =
                    Reference { rate, modulation_index, voltage_v: volts, udc_v: LINK_V, ..Reference::NONE };
                let chosen = |mode: &Mode| self.schedule().wanted(Instant(0), *mode, &seen, &self.devices);
                let cell = self.cell(&seen);
                let next: Vec<u8> = modes.iter().map(|mode| place(&modes, chosen(mode))).collect();
                let known = choices.entry(cell).or_insert(Choice { cell, seen, next: next.clone() });
                assert_eq!(next, known.next, "{seen:?} {:?}", known.seen);
            }
        }
        choices.into_values().collect()
    }
}

/// The rates within a span at which one side of a border begins to be below another, or not above it.
fn crossings([from, to]: [f32; 2], count: usize, sides: impl Fn(f32) -> Vec<f32>) -> Vec<f32> {
    let is_below: [fn(f32, f32) -> bool; 2] = [|a, b| a < b, |a, b| a <= b];
    let orders =
        (0..count * count).flat_map(|pair| is_below.map(|is_below| (pair / count, pair % count, is_below)));
    let crosses = |(i, j, is_below): (usize, usize, fn(f32, f32) -> bool)| {
        let holds = |rate: f32| is_below(sides(rate)[i], sides(rate)[j]);
        (!holds(from) && holds(to)).then(|| first(to, |rate| rate > from && holds(rate)))
    };
    orders.filter_map(crosses).collect()
}

/// The index that counts as made by a voltage: with the room that `wanted` gives it.
fn made(voltage_v: f32) -> f32 {
    voltage_v / crate::frames::six_step_v(LINK_V) + 0.02
}

fn place(modes: &[Mode], mode: Mode) -> u8 {
    modes.iter().position(|known| *known == mode).unwrap_or_else(|| panic!("{mode:?}")) as u8
}

/// The choices of every case, made once for all proofs.
fn every_choice() -> &'static [(Case, Vec<Choice>)] {
    static CHOICES: OnceLock<Vec<(Case, Vec<Choice>)>> = OnceLock::new();
    CHOICES.get_or_init(|| Case::all().into_iter().map(|case| (case, case.choices())).collect())
}

/// The choice in a cell.
struct Choice {
    cell: Cell,
    /// A reference in it.
    seen: Reference,
    /// For each mode, by its place, the one that is wanted.
    next: Vec<u8>,
}

impl Choice {
    /// The mode at which the choice stays, and the number of switches until then.
    fn settled(&self, mut mode: u8) -> (u8, u32) {
        for switches in 0..10 {
            let next = self.next[usize::from(mode)];
            if next == mode {
                return (mode, switches);
            }
            mode = next;
        }
        panic!("never settles: {:?}", self.seen);
    }
}

/// A wanted mode is on the ladder, and is still wanted once it has come, by one switch or by two: a free carrier gives way to a locked one, and that to a
/// pattern; the first of the optimised patterns may give way if less voltage is made than the operating point asks for.
#[test]
fn a_constant_input_ends_in_one_mode_of_the_ladder() {
    for (case, choices) in every_choice() {
        let on_ladder = case.ladder.modes().count() as u8;
        let modes = case.modes();
        let mut locked = case.ladder.modes().skip(1).skip_while(|mode| !mode.is_carrier());
        let by_carrier = locked.any(Mode::is_pattern);
        let most = if case.is_optimal() || by_carrier { 2 } else { 1 };
        let mut longest = 0;
        for choice in choices {
            assert!(choice.next.iter().all(|next| *next < on_ladder), "{:?}", choice.seen);
            for mode in 0..modes.len() as u8 {
                let (_, switches) = choice.settled(mode);
                longest = longest.max(switches);
            }
        }
        std::println!("{} modes, {} cells: {longest} switches", on_ladder, choices.len());
        assert_eq!(longest, if on_ladder == 1 { 1 } else { most });
    }
}

/// Between two inputs that no border's whole hysteresis separates, back and forth any number of times: no mode that was left is taken again.
#[test]
fn no_mode_is_taken_again_within_the_hysteresis() {
    for (_, choices) in every_choice() {
        let mut pairs = 0_u32;
        for (place, one) in choices.iter().enumerate() {
            for other in choices[place + 1..].iter().filter(|other| !one.cell.spans(&other.cell)) {
                pairs += 1;
                for (from, to) in [(one, other), (other, one)] {
                    for mode in 0..from.next.len() as u8 {
                        to_and_fro(from, to, mode);
                    }
                }
            }
        }
        std::println!("{} cells, {pairs} pairs within the hysteresis", choices.len());
        assert!(pairs as usize >= choices.len() - 1);
    }
}

/// Back and forth between two inputs, once the mode has settled at the first one.
fn to_and_fro(from: &Choice, to: &Choice, mode: u8) {
    let (mut mode, mut left, mut still) = (from.settled(mode).0, 0_u32, 0);
    let mut inputs = [to, from].into_iter().cycle();
    while still < 2 {
        let input = inputs.next().unwrap_or(to);
        still += 1;
        while input.next[usize::from(mode)] != mode {
            left |= 1 << mode;
            mode = input.next[usize::from(mode)];
            still = 0;
            assert!(left >> mode & 1 == 0, "mode {mode} again: {:?} {:?}", from.seen, to.seen);
        }
    }
}

/// A higher frequency, a larger index or both never lead to a lower rung of the paper's ladder.
#[test]
fn more_of_either_never_leads_down() {
    for (case, choices) in every_choice().iter().filter(|(case, _)| !case.is_optimal()) {
        let on_ladder = case.ladder.modes().count();
        for low in choices {
            let more = |high: &&Choice| {
                high.cell.share.includes(low.cell.share) && high.cell.index.includes(low.cell.index)
            };
            for high in choices.iter().filter(more) {
                let mut rungs = low.next.iter().zip(&high.next).take(on_ladder);
                assert!(rungs.all(|(low, high)| low <= high), "{:?} {:?}", low.seen, high.seen);
            }
        }
    }
}

/// A mode is kept for its dwell time, whatever comes, and no tick longer; also if the count of the ticks wraps or has
/// gone half round since. With gates off there is nothing to keep. A pattern does not wait below its smallest index.
#[test]
fn a_mode_is_kept_for_its_dwell_time_and_no_longer() {
    for (case, choices) in every_choice() {
        let dwell_ticks = case.schedule().dwell_ticks as u32;
        assert_eq!(dwell_ticks, 750_000, "30 ms");
        let modes = case.modes();
        for choice in choices {
            // The paper's modes do not depend on what is made, except here.
            let made_v = if case.is_optimal() { choice.seen.voltage_v } else { 900.0 };
            let seen = &Reference { voltage_v: made_v, ..choice.seen };
            for (mode, next) in modes.iter().zip(&choice.next) {
                for (elapsed, is_kept) in [
                    (0, true),
                    (1, true),
                    (dwell_ticks - 1, true),
                    (dwell_ticks, false),
                    (i32::MAX as u32, false),
                    (1 << 31, false),
                    (u32::MAX, false),
                ] {
                    let mut schedule = case.schedule();
                    let last = Instant(u32::MAX - 7);
                    schedule.switched(last);
                    let found = schedule.wanted(last.after(elapsed), *mode, seen, &case.devices);
                    let keeps = is_kept && !is_below(case, *mode, seen);
                    let wanted = if keeps { *mode } else { modes[usize::from(*next)] };
                    assert_eq!(found, wanted, "{mode:?} after {elapsed}: {seen:?}");
                    // A time that has run out stays so, however far the ticks count on.
                    let again = schedule.wanted(last, *mode, seen, &case.devices);
                    assert!(keeps || again == modes[usize::from(*next)]);
                }
            }
        }
    }
}

/// `true` if less is made than the voltage with which a mode waits: three quarters of six-step in a middle-60° pattern of the ladder.
fn is_below(case: &Case, mode: Mode, seen: &Reference) -> bool {
    let is_low = seen.voltage_v < 0.75 * crate::frames::six_step_v(seen.udc_v);
    is_low && mode.is_pattern() && case.ladder.modes().any(|rung| rung == mode)
        || is_below_its_branch(mode, seen)
}

#[cfg(not(feature = "optimal"))]
fn is_below_its_branch(_: Mode, _: &Reference) -> bool {
    false
}

/// `true` if less is made than the least of an optimised pattern.
#[cfg(feature = "optimal")]
fn is_below_its_branch(mode: Mode, seen: &Reference) -> bool {
    mode.branch().is_some_and(|branch| made(seen.voltage_v) < branch.first)
}

/// Out of rest each input has a mode at once: the one that the lowest mode ends in, or for the optimised ladder one that can catch a
/// machine.
#[test]
fn every_input_has_a_mode_to_begin_with() {
    for (case, choices) in every_choice() {
        let modes = case.modes();
        for choice in choices {
            let seen = &choice.seen;
            let mut schedule = case.schedule();
            schedule.switched(Instant(0));
            let begun = schedule.wanted(Instant(1), Mode::Off, seen, &case.devices);
            if case.is_optimal() {
                assert!([Mode::Async, Mode::Mid3, Mode::Square].contains(&begun), "{begun:?}: {seen:?}");
            } else {
                assert_eq!(begun, modes[usize::from(choice.settled(0).0)], "{seen:?}");
            }
        }
    }
}

/// NaN is in no mode's way: a frequency that is NaN has passed no border but the free carrier's, an index that is NaN
/// has passed none.
#[test]
fn what_is_no_number_counts_as_the_lowest_rung() {
    for case in Case::all().into_iter().filter(|case| case.ladder.modes().count() > 1) {
        let lowest = case.ladder.modes().nth(1);
        let rate = |hz: f32| hz * 4_294_967_296.0 / 25e6;
        for (rate, modulation_index, wanted) in [
            (f32::NAN, 0.0, lowest),
            (f32::NAN, f32::NAN, lowest),
            (rate(50.0), f32::NAN, lowest),
            (rate(30.0), f32::NAN, Some(Mode::Async)),
            (f32::NEG_INFINITY, 1.0, Some(Mode::Async)),
            (f32::INFINITY, f32::NAN, case.ladder.modes().last()),
        ] {
            let seen =
                Reference { rate, modulation_index, voltage_v: 900.0, udc_v: LINK_V, ..Reference::NONE };
            for mode in case.ladder.modes().filter(|mode| !mode.is_optimal()) {
                let found = case.schedule().wanted(Instant(0), mode, &seen, &case.devices);
                assert_eq!(Some(found), wanted, "{mode:?} {seen:?}");
            }
        }
    }
}

/// The largest fundamental of a mode: what notches of the shortest pulse leave of it, `1 − Σ sin(β/2)`, and for the others the value in their rows.
#[test]
fn the_shortest_pulse_takes_its_part_of_the_fundamental() {
    for (hz, min_pulse_ticks) in [(50.0, 250), (-120.0, 250), (200.0, 250), (300.0, 1_000), (300.0, 0)] {
        let devices = SwitchLimits::new(min_pulse_ticks, 0, 900.0, &CLOCK);
        let rate = (hz * 4_294_967_296.0 / 25e6) as f32;
        let half_notch = (core::f64::consts::PI * f64::abs(hz) * f64::from(min_pulse_ticks) / 25e6).sin();
        for (mode, sum) in [(Mode::Mid7, 5.758_77), (Mode::Mid5, 3.863_703), (Mode::Mid3, 2.0)] {
            let off = f64::from(index_limit(mode, rate, &devices)) - (1.0 - sum * half_notch);
            assert!(off.abs() < 2e-6, "{mode:?} {hz} Hz, {min_pulse_ticks}: {off}");
        }
        assert_eq!(index_limit(Mode::Square, rate, &devices), 1.0);
        for carrier in [Mode::Async, Mode::Sync15, Mode::Sync12] {
            assert_eq!(index_limit(carrier, rate, &devices), 0.906_899_7);
        }
    }
}

/// A pattern of the paper's ladder is still kept for its dwell time at three quarters of six-step; with less it is not.
#[test]
fn a_pattern_is_kept_down_to_three_quarters_of_six_step() {
    let case = Case::new(Ladder::PAPER, SHORTEST[1]);
    let least_v = first(f32::MAX, |volts| volts >= 0.75 * crate::frames::six_step_v(LINK_V));
    for (mode, waits) in
        [(Mode::Mid7, false), (Mode::Mid3, false), (Mode::Sync12, true), (Mode::Sync15, true)]
    {
        for (voltage_v, kept) in [(least_v, true), (least_v.next_down(), waits)] {
            // So slow that it is the free carrier's turn.
            let seen = Reference { voltage_v, udc_v: LINK_V, ..Reference::NONE };
            let mut schedule = case.schedule();
            schedule.switched(Instant(0));
            let wanted = if kept { mode } else { Mode::Async };
            assert_eq!(schedule.wanted(Instant(1), mode, &seen, &case.devices), wanted, "{mode:?}");
        }
    }
}

/// At its smallest index an optimised pattern is still kept for its dwell time; at the next number below it is not.
#[cfg(feature = "optimal")]
#[test]
fn an_optimised_pattern_is_kept_down_to_its_smallest_index() {
    let (case, mut exactly) = (Case::new(Ladder::OPTIMAL, SHORTEST[1]), 0);
    for (mode, branch) in Mode::ALL.into_iter().filter_map(|mode| Some((mode, mode.branch()?))) {
        let least_v = first(f32::MAX, |volts| made(volts) >= branch.first);
        for (voltage_v, wanted) in [(least_v, mode), (least_v.next_down(), Mode::Async)] {
            // So slow that it is the free carrier's turn.
            let seen = Reference { voltage_v, modulation_index: 0.9, udc_v: LINK_V, ..Reference::NONE };
            let mut schedule = case.schedule();
            schedule.switched(Instant(0));
            assert_eq!(schedule.wanted(Instant(1), mode, &seen, &case.devices), wanted, "{mode:?}");
        }
        exactly += u32::from(made(least_v) == branch.first);
    }
    assert!(exactly > 0, "no voltage makes just a smallest index");
}

/// The paper's patterns keep their borders, whatever control fills a pattern up to before square wave: a build without the optimised patterns has the same.
#[cfg(feature = "optimal")]
#[test]
fn the_papers_borders_are_without_a_floor() {
    let wanted = |ladder, mode| {
        let case = Case::new(ladder, SHORTEST[1]);
        let rate = first(f32::MAX, |rate| 900.0 * case.share(rate) >= 296.5);
        let seen =
            Reference { rate, modulation_index: 0.5, voltage_v: 900.0, udc_v: LINK_V, ..Reference::NONE };
        case.schedule().wanted(Instant(0), mode, &seen, &case.devices)
    };
    assert_eq!(wanted(Ladder::PAPER, Mode::Mid3), Mode::Mid3);
    assert_eq!(wanted(Ladder::OPTIMAL, Mode::Opp3a), Mode::Opp3b);
}
