//! The course of the experiment: the change of current for the next command to make.

use super::followed::Followed;
use super::inductance::Inductance;
use super::noise::Noise;
use super::observation::Stage;
use super::pulses::{Pulses, Region};
use super::zero::Zero;
use crate::frames::{Abc, Dq, SinCos, limit};
use crate::machine::Ratings;

/// A half that has passed.
pub struct Seen {
    /// Current at its beginning, in A.
    pub before: Dq,
    /// Current at its end, in A.
    pub current: Dq,
    /// Volt-seconds that acted, in V·s.
    pub acted: Dq,
    /// Turn of the rotor, electrical, in rad.
    pub turned: f32,
    /// Length, in s.
    pub length_s: f32,
    /// Electrical angular speed, in rad/s.
    pub omega: f32,
    /// Direction of the rotor's d axis at its end.
    pub frame: SinCos,
}

/// The experiment's state.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    stage: Stage,
    /// Commands since the beginning of the stage or of its step; and the number of the step.
    commands: u32,
    step: u32,
    /// Halves since the last guess of the inductance, in [`Stage::Probe`]; and how its currents follow the volt-seconds.
    waited: u32,
    followed: Followed,
    noise: Noise,
    /// Current when the voltage of the probe's first pulses was last raised, in A, and their volt-seconds since then, in V·s.
    from: Dq,
    fed: Dq,
    pulses: Pulses,
    /// Stator resistance, in ohm, as shown by the staircase.
    resistance_ohm: f32,
    /// Voltage that each leg lacks in the direction of its current, in V, likewise; and one over the phase current with a sure direction, per A.
    lacking_v: f32,
    per_small_a: f32,
    /// The voltage that holds a current, besides its drop in those, in V.
    held_v: Dq,
    /// Voltage and current of two steps of the staircase, summed, and their number.
    shown: [Shown; 2],
    /// Electrical speed, in rad/s, and direction of the rotor's d axis.
    omega: f32,
    frame: SinCos,
    zero: Zero,
}

/// Sums over a step of the staircase.
#[derive(Clone, Copy, Debug)]
struct Shown {
    volts: f32,
    amperes: f32,
    count: f32,
}

const NONE: Dq = Dq { d: 0.0, q: 0.0 };

/// Commands without voltage before the first pulse, which show the current sensors' readings without current: the noise within 6 % (standard error).
const QUIET: u32 = 120;
/// Voltage of the first pulse, as a share of the link's largest; the growth to the next one, and the halves until then.
const FIRST_SHARE: f32 = 0.003;
const GROWTH: f32 = 1.5;
const PROBE_HALVES: u32 = 4;
/// Way of the current under one voltage with which it has moved, over the change that counts as noise; and change from which something is learnt, likewise.
/// The dead time takes its part of small voltages: with half the way it makes the inductance look several times as large.
const SEEN: f32 = 3.0;
const LEARNT: f32 = 0.6;
/// The change that a probe wants, as a share of the bound; the directions of the probes after the first one seen, the change that they want, likewise, for a
/// machine without saliency, and their number.
const PROBE_SHARE: f32 = 0.03;
const AROUND: [[f32; 2]; 4] = [[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]];
const AROUND_SHARE: f32 = 0.12;
const PROBES_AROUND: u32 = 24;
/// Most commands that are under way when another one comes.
const LATE: u32 = 3;
/// Newest boundaries before the first pulse whose changes of current show the noise.
pub const QUIET_CHANGES: usize = (QUIET - LATE) as usize;
/// Phase current with a sure direction, likewise.
const SMALL_SHARE: f32 = 0.01;
/// The largest change in a half on the way to a direct current, likewise.
const LED_SHARE: f32 = 0.05;

/// Least inductance along d, as a share of the least that was seen: of the first, and once pulses along d have seen all.
const FLOOR_SHARES: [f32; 2] = [0.2, 0.5];

/// Direct currents along d, as shares of the bound or, if negative, of the machine's least current along d, and commands for each. Those come first beside
/// which no current along q takes back a rotor that turns away. Two of them show the resistance.
const STAIRCASE: [f32; 8] = [0.1, 0.2, -0.1, -0.25, -0.5, -0.75, -0.9, -0.6];
const STEP_COMMANDS: u32 = 36;
const SHOWING: [u32; 2] = [4, 6];
/// Commands after a step's beginning from which on it shows.
const SETTLED_COMMANDS: u32 = 18;

/// Commands of the pulses along d, along q, along both, and of the rest after them.
const ALONG_D: u32 = 180;
const ALONG_Q: u32 = 400;
const ALONG_BOTH: u32 = 2_300;
const REST: u32 = 16;

/// Shares of the bound at which the pulses along d and along q begin.
const FIRST_SHARES: [f32; 2] = [0.5, 0.2];

/// Current along d beside the pulses along q and while the rotor turns, as a share of the least one: no phase is without current for long. Beside the last
/// pulses it goes to and fro between shares of the bound and of that. Ways in a command, at first and growing by as much with each command: no two ways take
/// equally long, so pulses along q whose to and fro fits into one of them fall elsewhere in the next.
const HELD_D: f32 = -0.2;
const SWEPT: [f32; 2] = [0.18, -0.93];
const SWEEPS: f32 = 1.0 / 265.0;
const SWEEPS_GROWTH: f32 = 5.3e-7;

/// Distance of the rotor, mechanical, in rad, from where it should be before it is to turn: the angle is wrong, or a load turns it. The
/// experiment then ends.
const AWAY_RAD: f32 = 0.087;

/// Current that turns the rotor, as a share of the bound; speed at which it ends, as a share of the largest, and as electrical radians a
/// command; the most commands for it, and those of coasting.
const TURN_SHARE: f32 = 0.25;
const TURN_SPEED_SHARE: f32 = 0.1;
const TURN_RAD: f32 = 0.03;
const TURN_COMMANDS: u32 = 3_600;
const COAST_COMMANDS: u32 = 1_800;

/// Share of the way to a direct current that one command covers, and share of a half's unexplained voltage that is assumed to stay.
const LEAD: f32 = 0.4;
const HELD: f32 = 0.3;
/// The latter along d beside pulses along q; and the former along q over that along d, for the current that keeps the rotor in place.
const HELD_BESIDE: f32 = 0.1;
const STEERED: f32 = 2.0;

impl Course {
    /// The state before the first command.
    pub const fn new() -> Self {
        const NOTHING: Shown = Shown { volts: 0.0, amperes: 0.0, count: 0.0 };
        Self {
            stage: Stage::Probe,
            commands: 0,
            step: 0,
            waited: 0,
            followed: Followed::NOTHING,
            noise: Noise::UNKNOWN,
            from: NONE,
            fed: NONE,
            pulses: Pulses::new(),
            resistance_ohm: 0.0,
            lacking_v: 0.0,
            per_small_a: 1.0,
            held_v: NONE,
            shown: [NOTHING; 2],
            omega: 0.0,
            frame: SinCos { sin: 0.0, cos: 1.0 },
            zero: Zero::new(),
        }
    }

    /// The part of the experiment in progress.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// The angle's zero.
    pub fn zero(&self) -> &Zero {
        &self.zero
    }

    /// Notes the time for which a command acts, in s.
    pub fn lasts(&mut self, length_s: f32) {
        self.pulses.lasts(length_s);
    }

    /// Voltage that a current takes by itself, in V, with the rotor's d axis in this direction: the resistance's, the inverter's error, and
    /// the remainder of both.
    pub fn drop_v(&self, current: Dq, frame: SinCos) -> Dq {
        let share = |phase_a: f32| limit(phase_a * self.per_small_a, -1.0, 1.0);
        let Abc { a, b, c } = current.unpark(frame).abc();
        let signs = Abc { a: share(a), b: share(b), c: share(c) }.clarke().park(frame);
        current * self.resistance_ohm + signs * self.lacking_v + self.held_v
    }

    /// Takes a half that has passed.
    pub fn learn(&mut self, seen: &Seen, inductance: &mut Inductance, ratings: &Ratings) {
        let (bound_a, pole_pairs) = (ratings.max_current_a, ratings.pole_pairs);
        (self.omega, self.frame) = (seen.omega, seen.frame);
        self.pulses.turned(seen, bound_a);
        let change = seen.current - seen.before;
        let mean = (seen.current + seen.before) * 0.5;
        match self.stage {
            Stage::Probe => self.probe(seen, change, inductance, bound_a),
            Stage::Staircase if self.commands > SETTLED_COMMANDS => {
                self.show(seen.acted.d - inductance.flux(change).d, mean.d, seen.length_s);
            }
            _ => {}
        }
        let back_share = match self.stage {
            Stage::Staircase | Stage::AlongD => self.pulses.back_share(pole_pairs),
            _ => 0.0,
        };
        self.zero.turn(back_share, mean.d / bound_a, seen.length_s);
        let drop = self.drop_v(mean, seen.frame);
        let fed = seen.acted - drop * seen.length_s;
        let least_a = LEARNT * self.noise.change_a();
        let learns = change.squared() > least_a * least_a;
        if matches!(self.stage, Stage::AlongQ | Stage::AlongBoth) {
            let is_outward = learns && mean.q * fed.q > 0.0;
            self.pulses.went(is_outward, inductance.flux(change).q / fed.q);
        }
        // A current that stands still tells little by its changes.
        if learns && !matches!(self.stage, Stage::Probe | Stage::Rest | Stage::Turn | Stage::Done) {
            inductance.learn(change, fed, &self.noise);
        }
        let [along_d, along_q] = match self.stage {
            Stage::Done if self.step > 0 => [0.0; 2],
            Stage::Staircase => [HELD, 0.0],
            Stage::Rest | Stage::Turn | Stage::Done => [HELD; 2],
            Stage::AlongQ | Stage::AlongBoth => [HELD_BESIDE, 0.0],
            _ => [0.0; 2],
        };
        // Part of a half's unexplained voltage persists, on the way to a direct current and there.
        let more = (seen.acted - inductance.flux(change)) * (1.0 / seen.length_s) - drop;
        self.held_v = self.held_v + Dq { d: more.d * along_d, q: more.q * along_q };
    }

    /// A half of the probe: along d until a current moves, then along both axes.
    fn probe(&mut self, seen: &Seen, change: Dq, inductance: &mut Inductance, bound_a: f32) {
        self.fed = self.fed + seen.acted;
        let (way, seen_a) = (seen.current - self.from, SEEN * self.noise.change_a());
        if self.step > 0 {
            // At first the earlier commands are still on their way.
            if self.commands > LATE {
                self.followed = self.followed.and(change, seen.acted);
            }
        } else if self.commands <= QUIET {
            if self.commands > LATE {
                self.noise.shows(change, bound_a);
            }
            self.waits_from(seen.current);
        } else if way.squared() > seen_a * seen_a {
            // Whatever the direction: it may be that of other sensors.
            inductance.guess(self.fed.length() / way.length());
            inductance.settle(FLOOR_SHARES[0]);
            (self.commands, self.step) = (0, 1);
        } else {
            self.waited += 1;
            if self.waited >= PROBE_HALVES {
                inductance.scale(GROWTH);
                self.waits_from(seen.current);
            }
        }
    }

    /// Begins to wait for a current to move from where it is.
    fn waits_from(&mut self, current: Dq) {
        (self.from, self.fed, self.waited) = (current, NONE, 0);
    }

    /// A half at a direct current.
    fn show(&mut self, volt_seconds: f32, amperes: f32, length_s: f32) {
        for (shown, step) in self.shown.iter_mut().zip(SHOWING) {
            if step == self.step {
                shown.volts += volt_seconds / length_s;
                shown.amperes += amperes;
                shown.count += 1.0;
            }
        }
    }

    /// The change of current that the command is to make from the current `ahead`, with volt-seconds up to `reach` in V·s.
    pub fn change(&mut self, ahead: Dq, reach: f32, inductance: &mut Inductance, ratings: &Ratings) -> Dq {
        let bound_a = ratings.max_current_a;
        if inductance.is_unknown() {
            inductance.guess(FIRST_SHARE * reach / (PROBE_SHARE * bound_a));
        }
        self.commands += 1;
        let before = self.stage;
        self.advance(ratings);
        if self.pulses.turned_rad().abs() > AWAY_RAD * ratings.pole_pairs
            && !matches!(self.stage, Stage::Turn | Stage::Done)
        {
            self.enter(Stage::Done);
        }
        if before == Stage::AlongD && self.stage != before {
            inductance.settle(FLOOR_SHARES[1]);
        }
        let region =
            |held: Dq| Region { along_q: self.stage != Stage::AlongD, held, bound_a, reach, ratings };
        match self.stage {
            Stage::Probe if self.step > 0 => {
                let [d, q] = AROUND.get((self.commands % 4) as usize).copied().unwrap_or([0.0; 2]);
                Dq { d, q } * (AROUND_SHARE * bound_a)
            }
            Stage::Probe if self.commands <= QUIET => NONE,
            Stage::Probe => Dq { d: -PROBE_SHARE * bound_a, q: 0.0 },
            Stage::Staircase => {
                let share = STAIRCASE.get(self.step as usize).copied().unwrap_or(0.0);
                let back = if share < 0.0 { self.pulses.back_share(ratings.pole_pairs) } else { 0.0 };
                let held = Dq { d: along_d_a(share, ratings), q: back * bound_a };
                let change = Self::lead(ahead, held, bound_a);
                Dq { q: change.q * STEERED, ..change }
            }
            Stage::AlongD => {
                let back = self.pulses.back_share(ratings.pole_pairs);
                let region = region(Dq { d: 0.0, q: back * bound_a });
                self.pulses.change(ahead, &region, inductance)
            }
            Stage::AlongQ => {
                let region = region(Dq { d: along_d_a(HELD_D, ratings), q: 0.0 });
                self.pulses.change(ahead, &region, inductance)
            }
            Stage::AlongBoth => {
                let region = region(Dq { d: along_d_a(self.swept() * self.pulses.share(), ratings), q: 0.0 });
                self.pulses.change(ahead, &region, inductance)
            }
            Stage::Done if self.step > 0 => NONE,
            Stage::Rest | Stage::Done => Self::lead(ahead, NONE, bound_a),
            Stage::Turn => {
                let share = [TURN_SHARE, 0.0, -TURN_SHARE].get(self.step as usize).copied().unwrap_or(0.0);
                let held = Dq { d: along_d_a(HELD_D, ratings), q: share * bound_a };
                Self::lead(ahead, held, bound_a)
            }
        }
    }

    /// The slow sweep along d, as a share of the bound, or of the least current along d.
    fn swept(&self) -> f32 {
        let commands = self.commands as f32;
        let ways = commands * (SWEEPS + 0.5 * SWEEPS_GROWTH * commands);
        let whole = ways as u32;
        let part = ways - whole as f32;
        let way = if whole.is_multiple_of(2) { part } else { 1.0 - part };
        let [first, last] = SWEPT;
        first + (last - first) * way
    }

    /// One command's part of the way to a direct current.
    fn lead(ahead: Dq, wanted: Dq, bound_a: f32) -> Dq {
        let most = LED_SHARE * bound_a;
        let away = wanted - ahead;
        let length = away.length();
        let change = away * LEAD;
        if length * LEAD > most { away * (most / length) } else { change }
    }

    fn enter(&mut self, stage: Stage) {
        (self.stage, self.commands, self.step) = (stage, 0, 0);
    }

    /// The end, without voltage: currents whose sensors read something else, or mostly noise, cannot be held.
    fn refuse(&mut self) {
        self.enter(Stage::Done);
        self.step = 1;
    }

    /// Goes on to the next step or stage if this one is over.
    fn advance(&mut self, ratings: &Ratings) {
        let after = |limit: u32| self.commands > limit;
        match self.stage {
            Stage::Probe
                if self.step == 0
                    && self.commands == QUIET + 1
                    && self.noise.is_too_much(ratings.max_current_a) =>
            {
                self.refuse();
            }
            Stage::Probe if self.step > 0 && after(PROBES_AROUND) => {
                if self.followed.is_machine() {
                    self.enter(Stage::Staircase)
                } else {
                    self.refuse()
                }
            }
            Stage::Staircase if after(STEP_COMMANDS) => {
                (self.commands, self.step) = (0, self.step + 1);
                if self.step as usize == STAIRCASE.len() {
                    self.settle(ratings.max_current_a);
                    self.pulses.begin(FIRST_SHARES[0]);
                    self.enter(Stage::AlongD);
                }
            }
            Stage::AlongD if after(ALONG_D) => {
                self.pulses.begin(FIRST_SHARES[1]);
                self.enter(Stage::AlongQ);
            }
            Stage::AlongQ if after(ALONG_Q) => self.enter(Stage::AlongBoth),
            Stage::AlongBoth if after(ALONG_BOTH) => self.enter(Stage::Rest),
            Stage::Rest if after(REST) => self.enter(Stage::Turn),
            Stage::Turn => self.turn(ratings),
            _ => {}
        }
    }

    /// Speeds up, coasts, brakes.
    fn turn(&mut self, ratings: &Ratings) {
        let fast = TURN_SPEED_SHARE * ratings.max_speed_rad_s * ratings.pole_pairs;
        let per_command = self.pulses.per_s(TURN_RAD);
        let fast = if fast < per_command { fast } else { per_command };
        let over = match self.step {
            0 => self.omega > fast || self.commands > TURN_COMMANDS,
            1 => self.commands > COAST_COMMANDS,
            _ => self.omega < 0.0 || self.commands > TURN_COMMANDS,
        };
        if over && self.step == 2 {
            self.enter(Stage::Done);
        } else if over {
            (self.commands, self.step) = (0, self.step + 1);
        }
    }

    /// Resistance and voltage error from two steps of the staircase on one side of zero: the error is the same in both.
    fn settle(&mut self, bound_a: f32) {
        let [low, high] = self.shown.map(|shown| {
            let per = 1.0 / (shown.count + f32::MIN_POSITIVE);
            (shown.volts * per, shown.amperes * per)
        });
        let amperes = low.1 - high.1;
        let slope = if amperes * amperes > 0.0 { (low.0 - high.0) / amperes } else { 0.0 };
        self.resistance_ohm = limit(slope, 0.0, 1e3);
        (self.per_small_a, self.held_v) = (1.0 / (SMALL_SHARE * bound_a), NONE);
        // With the phases' directions alone the drop is that of one volt for each leg.
        self.lacking_v = 1.0;
        let along_d = self.drop_v(Dq { d: low.1, q: 0.0 }, self.frame).d - low.1 * self.resistance_ohm;
        let lacks = (low.0 - low.1 * self.resistance_ohm) / along_d;
        self.lacking_v = if lacks > 0.0 { lacks } else { 0.0 };
    }
}

/// Current along d, in A: a share of the bound, or if it is negative of the machine's least current along d.
fn along_d_a(share: f32, ratings: &Ratings) -> f32 {
    share * if share < 0.0 { -ratings.min_id_a } else { ratings.max_current_a }
}
