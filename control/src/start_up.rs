//! Initial angle at standstill: a law whose voltage pulses show the rotor's position in a machine whose sensor only counts.
//!
//! 1. **Still**: the gates stay off until the sensor has counted nothing for a while.
//! 2. **Axis**: pulses in twelve directions, round after round. Each pulse is followed by its opposite, which removes the flux linkage again. Each command
//!    corrects for what the halves before it have really made, because a command acts for one or two halves of a carrier as long as a control period. With
//!    `i = A ψ + B ψ*` as complex numbers, the sum of `Δi Δψ` over all directions keeps `B`, whose angle is twice that of the d axis (the axis of least
//!    inductance), and of `A` only what pulses of unequal length leave. Dead time, offsets and saturation cancel in the sum or do not turn it.
//! 3. **Polarity**: magnets saturate the iron along +d, so a pulse there takes more current than one along −d. Over all directions the pulses' currents cancel
//!    except for that difference. A machine without magnets has no polarity to find. If the map says that the iron saturates along −d, as the bridges of some
//!    reluctance machines do, the currents are not trusted.
//! 4. **Push**: if the currents do not show the polarity, the rotor's motion does. A q-axis current grows until the rotor has moved by half a degree or so
//!    more than it drifts, and then brakes the rotor.
//!
//! Currents and voltages are expressed in the rotor's frame: a heavy rotor swings by a fraction of a degree meanwhile, a light one by some degrees. If the
//! rotor is turned farther, the law starts over.

#![forbid(unsafe_code)]

use crate::frames::{AlphaBeta, Angle, SinCos, sqrt};
use crate::machine::{Ratings, Tables};

/// Time for which the rotor has to stand still, in s; and the turn up to which it counts as standing still, electrical: 1°.
const STILL_S: f32 = 0.1;
const STILL: Angle = Angle(11_930_465);
/// Turn that makes the law start over: 10°.
const TURNED: Angle = Angle(119_304_647);
/// Turn that shows the direction of a push, electrical: 2°.
pub const PUSHED: Angle = Angle(23_860_929);

/// Current along −d whose flux linkage a pulse reaches, as a share of the largest.
pub const PULSE_SHARE: f32 = 0.3;
/// Commands without voltage before the first pulse.
const LEAD: u32 = 4;
/// Pulses of the rounds, in twelve directions each.
const PULSES: u32 = 96;
/// Most commands for building up a pulse.
const LONGEST: f32 = 32.0;

/// Growth of a push's current along q, in shares of the largest per s; and the longest time of a push, in s.
pub const PUSH_GROWTH_HZ: f32 = 1.0;
const PUSH_S: f32 = 0.5;
/// Time without current that shows the drift before a push, in s.
const REST_S: f32 = 0.02;
/// Length of the brake's memory of the turn, as a share of the push's length; the part of [`PUSHED`] beyond that memory at which the rotor counts as standing
/// again; and the longest time until then, in push lengths.
const BRAKE_SHARE: f32 = 0.25;
const BRAKED: Angle = Angle(PUSHED.0 / 64);
const BRAKES: u32 = 4;
/// Share of the push's last current that brakes a turn of [`PUSHED`] beyond that memory. A push `k t` takes `t` to `θ = k t³/6`; a rotor braked by `g` times
/// its turn beyond a memory of length `T` does not swing up to `g = 1/4T²`, in units of its acceleration: for a quarter of `t`, ⅔ of `k t` over `θ`.
const BRAKE_GAIN: f32 = 2.0 / 3.0;
/// Share of the way to a push's current that one command covers, by the mean of both axes' inverse inductances.
const LEAD_SHARE: f32 = 0.2;
/// Share of that voltage which later commands keep, for the drop of resistance and devices.
const HELD_SHARE: f32 = 0.1;

/// Least ratio `B` over `A`, (L_q − L_d)/(L_q + L_d) of the inductances, at which there is an axis.
pub const SALIENT: f32 = 0.03;
/// Share of the currents' way along the pulses that shows the polarity.
const POLAR_SHARE: f32 = 0.02;
/// Share by which the map's iron may saturate more along −d than along +d.
const BENT_SHARE: f32 = 0.02;

/// The inputs of a command.
#[derive(Clone, Copy, Debug)]
pub struct StartUpInput<'a> {
    /// Largest voltage, peak phase, in V.
    pub limit_v: f32,
    /// Time for which a command acts, in s, greater than zero.
    pub interval_s: f32,
    /// Volt-seconds from the last observed boundary until the command acts, in V·s.
    pub committed: AlphaBeta,
    /// The machine.
    pub tables: &'a Tables,
}

/// The outcome of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartUpStep {
    /// Gates off.
    Wait,
    /// This voltage, peak phase, in V.
    Pulse(AlphaBeta),
    /// The electrical angle that the rotor had when its sensor began to count. Gates off.
    Found(Angle),
    /// No axis or no polarity can be found. Gates off.
    Failed,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Still,
    /// No voltage while the gates switch on.
    Lead,
    Axis,
    Rest,
    Push,
    Brake,
}

/// The law's state.
#[derive(Clone, Copy, Debug)]
pub struct StartUp {
    stage: Stage,
    /// Time for which the rotor has stood still, in s; its turn at the beginning of that time, and now.
    still_s: f32,
    from: Angle,
    turned: Angle,
    /// Turn at the beginning of this stage, or the brake's memory of it.
    stage_from: Angle,
    /// Number of commands in this pulse, push or rest; number of pulses.
    commands: u32,
    pulses: u32,
    /// The rotor's drift in one command before the push, in units of [`Angle`]; the push's number of commands, and whether it went backward.
    drift: i32,
    pushed: u32,
    against: bool,
    /// Voltage that holds the push's current, in V.
    held_v: AlphaBeta,
    /// Number of commands that build up the pulse, and its flux linkage in Wb.
    halves: u32,
    pulse_wb: f32,
    /// Current at the last boundary, in A; and the volt-seconds of all halves until then, in V·s.
    before: AlphaBeta,
    flux: AlphaBeta,
    /// Sums over the boundaries with a flux linkage: `Δi Δψ`, `Δψ Δψ`, `Δi·Δψ`, `Δψ²`, currents and flux linkages of the pulses; and their number.
    salient: AlphaBeta,
    uneven: AlphaBeta,
    round: f32,
    squared: f32,
    polar: AlphaBeta,
    pulsed: AlphaBeta,
    count: f32,
    /// Electrical angle of the axis when the rotor is at `from`.
    axis: Angle,
}

impl StartUp {
    /// The state before the first command.
    pub const fn new() -> Self {
        const NONE: AlphaBeta = AlphaBeta { alpha: 0.0, beta: 0.0 };
        Self {
            stage: Stage::Still,
            still_s: 0.0,
            from: Angle::ZERO,
            turned: Angle::ZERO,
            stage_from: Angle::ZERO,
            commands: 0,
            pulses: 0,
            drift: 0,
            pushed: 0,
            against: false,
            held_v: NONE,
            halves: 0,
            pulse_wb: 0.0,
            before: NONE,
            flux: NONE,
            salient: NONE,
            uneven: NONE,
            round: 0.0,
            squared: 0.0,
            polar: NONE,
            pulsed: NONE,
            count: 0.0,
            axis: Angle::ZERO,
        }
    }

    /// `true` until the first pulse.
    pub fn is_waiting(&self) -> bool {
        self.stage == Stage::Still
    }

    /// Takes the current at a carrier boundary, in A, and the volt-seconds since the last one, in V·s; `None` if they are not known.
    pub fn observe(&mut self, current: AlphaBeta, volt_seconds: Option<AlphaBeta>) {
        let change = current - self.before;
        let twice = current + self.before;
        self.before = current;
        self.flux = self.flux + volt_seconds.unwrap_or_default();
        let Some(flux) = volt_seconds.filter(|_| self.stage == Stage::Axis) else { return };
        let back = (self.from - self.turned).sin_cos();
        let [change, twice, flux] = [change, twice, flux].map(|vector| vector.turned(back));
        self.salient = self.salient + times(change, flux);
        self.uneven = self.uneven + times(flux, flux);
        self.round += change.dot(flux);
        self.squared += flux.squared();
        let built = twice.dot(flux);
        if built > 0.0 {
            (self.polar, self.pulsed, self.count) =
                (self.polar + change, self.pulsed + flux, self.count + 1.0);
        } else if built < 0.0 {
            (self.polar, self.pulsed, self.count) =
                (self.polar - change, self.pulsed - flux, self.count + 1.0);
        }
    }

    /// Takes the rotor's electrical turn since its sensor began to count, `passed_s` after the last one.
    pub fn turn(&mut self, turned: Angle, passed_s: f32) {
        self.still_s += passed_s;
        self.turned = turned;
        let limit = if self.is_waiting() { STILL } else { TURNED };
        if off(turned - self.stage_from) > limit.0 {
            *self = Self { from: turned, turned, stage_from: turned, ..Self::new() };
        }
    }

    /// The next command.
    pub fn step(&mut self, input: &StartUpInput) -> StartUpStep {
        let nothing = StartUpStep::Pulse(AlphaBeta::default());
        match self.stage {
            Stage::Still if self.still_s < STILL_S => return StartUpStep::Wait,
            Stage::Still => self.begin(Stage::Lead),
            Stage::Lead if self.commands < LEAD => {
                self.commands += 1;
                return nothing;
            }
            Stage::Lead => self.begin(Stage::Axis),
            Stage::Axis => {}
            Stage::Rest | Stage::Push | Stage::Brake => return self.push(input),
        }
        if self.stage == Stage::Lead {
            return nothing;
        }
        if self.commands == 0 {
            (self.halves, self.pulse_wb) = pulse(input);
        }
        if self.commands == 2 * self.halves {
            (self.commands, self.pulses) = (0, self.pulses + 1);
            if self.pulses == PULSES
                && let Some(ends) = self.judge(input.tables)
            {
                return ends;
            }
            return self.steer(AlphaBeta::default(), input);
        }
        self.commands += 1;
        let built =
            if self.commands <= self.halves { self.commands } else { 2 * self.halves - self.commands };
        // Four directions at right angles: one, its opposite, then the other two, so that the torques of magnets and of saliency cancel in each
        // four; then the same 30° further.
        let turned = (self.pulses >> 2).wrapping_mul(Angle::DEG_30.0);
        let across = if self.pulses & 2 == 0 { Angle::ZERO } else { Angle::DEG_90 };
        let direction = Angle(turned ^ self.pulses << 31) + across;
        self.steer(along(direction) * (self.pulse_wb * built as f32 / self.halves as f32), input)
    }

    /// The voltage that brings the halves' volt-seconds since the start to the wanted ones, in V·s.
    fn steer(&self, wanted: AlphaBeta, input: &StartUpInput) -> StartUpStep {
        let voltage = (wanted - self.flux - input.committed) * (1.0 / input.interval_s);
        let most = input.limit_v / (sqrt(voltage.squared()) + f32::MIN_POSITIVE);
        StartUpStep::Pulse(if most < 1.0 { voltage * most } else { voltage })
    }

    /// The axis, and the polarity of its magnets if the currents show it.
    fn judge(&mut self, tables: &Tables) -> Option<StartUpStep> {
        let per = 1.0 / self.squared;
        let (salient, uneven, round) = (self.salient * per, self.uneven * per, self.round * per);
        // `A` and `B`, from the sums of `Δi Δψ* = A Δψ Δψ* + B Δψ* Δψ*`, of which `round` is the real part, and of `Δi Δψ = A Δψ Δψ + B Δψ* Δψ`.
        let a = (round - salient.dot(uneven)) / (1.0 - uneven.squared());
        let b = salient - uneven * a;
        // NaN is no axis.
        let has_axis = sqrt(b.squared()) > SALIENT * a;
        if !has_axis {
            return Some(StartUpStep::Failed);
        }
        self.axis = Angle((b.angle().signed() >> 1) as u32);
        if !tables.ratings.has_magnets() {
            return Some(self.found(false));
        }
        // Less what pulses that are longer one way than the other contribute by themselves.
        let mirrored = AlphaBeta { beta: -self.pulsed.beta, ..self.pulsed };
        let polar = self.polar - self.pulsed * a - times(b, mirrored);
        let polar_a = polar.park(self.axis.sin_cos()).d;
        // The currents' way is the sum of `Δi·Δψ` over the flux linkages' mean.
        let way = POLAR_SHARE * self.round;
        if polar_a * polar_a * self.squared > way * way * self.count && !saturates_backward(tables) {
            return Some(self.found(polar_a < 0.0));
        }
        self.begin(Stage::Rest);
        None
    }

    fn begin(&mut self, stage: Stage) {
        (self.stage, self.commands, self.pulses, self.stage_from) = (stage, 0, 0, self.turned);
    }

    /// One command of the push, of the rest before it or of the brake after it.
    fn push(&mut self, input: &StartUpInput) -> StartUpStep {
        let moved = self.turned - self.stage_from;
        self.commands += 1;
        let growth = PUSH_GROWTH_HZ * input.interval_s;
        let passed_s = input.interval_s * self.commands as f32;
        let share = match self.stage {
            Stage::Push if passed_s > PUSH_S => return StartUpStep::Failed,
            Stage::Push => {
                let drifted = (self.commands as i32).wrapping_mul(self.drift);
                let pushed = moved - Angle(drifted as u32);
                if off(pushed) > PUSHED.0 {
                    (self.pushed, self.against) = (self.commands, pushed.signed() < 0);
                    (self.stage, self.commands) = (Stage::Brake, 0);
                }
                PUSH_GROWTH_HZ * passed_s
            }
            Stage::Brake if off(moved) < BRAKED.0 || self.commands > BRAKES * self.pushed => {
                return self.found(self.against);
            }
            Stage::Brake => {
                let pushed = self.pushed as f32;
                let beyond = moved.signed() as f32;
                let forgotten = (beyond / (1.0 + BRAKE_SHARE * pushed)) as i32;
                self.stage_from = self.stage_from + Angle(forgotten as u32);
                let share = BRAKE_GAIN / PUSHED.0 as f32 * beyond * (growth * pushed);
                if self.against { share } else { -share }
            }
            _ if passed_s > REST_S => {
                self.drift = (moved.signed() as f32 / self.commands as f32) as i32;
                self.begin(Stage::Push);
                0.0
            }
            _ => 0.0,
        };
        let across = self.axis + (self.turned - self.from) + Angle::DEG_90;
        let wanted = along(across) * (share * input.tables.ratings.max_current_a);
        let lead_ohm = LEAD_SHARE * self.squared / (self.round * input.interval_s);
        let led_v = (wanted - self.before) * lead_ohm;
        self.held_v = self.held_v + led_v * HELD_SHARE;
        StartUpStep::Pulse(led_v + self.held_v)
    }

    /// The result, with d along the axis or against it.
    fn found(&self, against: bool) -> StartUpStep {
        StartUpStep::Found(Angle((self.axis - self.from).0 ^ u32::from(against) << 31))
    }
}

/// The part of a rotor angle's error that matters: for a machine without magnets a half turn does not.
pub const fn axis_error(ratings: &Ratings, error: Angle) -> Angle {
    if ratings.has_magnets() { error } else { Angle(((error.0 << 1) as i32 >> 1) as u32) }
}

/// Decrease of the flux linkage by the pulses' current along −d and increase by their current along +d, in Wb.
#[inline(never)]
fn along_d_wb(tables: &Tables) -> (f32, f32) {
    let current_a = PULSE_SHARE * tables.ratings.max_current_a;
    let [down_wb, none_wb, up_wb] = [-current_a, 0.0, current_a].map(|id_a| psi_d_wb(tables, id_a));
    (none_wb - down_wb, up_wb - none_wb)
}

/// Flux linkage along d of a current along it, in Wb.
#[inline(never)]
fn psi_d_wb(tables: &Tables, id_a: f32) -> f32 {
    tables.flux.at(id_a, 0.0)[0]
}

/// `true` for a map whose iron saturates along −d rather than +d.
fn saturates_backward(tables: &Tables) -> bool {
    let (down_wb, up_wb) = along_d_wb(tables);
    up_wb > (1.0 + BENT_SHARE) * down_wb
}

/// Number of commands that build up a pulse, and its flux linkage in Wb.
fn pulse(input: &StartUpInput) -> (u32, f32) {
    let (pulse_wb, _) = along_d_wb(input.tables);
    let most_wb = input.limit_v * input.interval_s;
    let share = pulse_wb / most_wb;
    if share < LONGEST { (share as u32 + 1, pulse_wb) } else { (LONGEST as u32, LONGEST * most_wb) }
}

/// The product of two vectors as complex numbers.
fn times(one: AlphaBeta, other: AlphaBeta) -> AlphaBeta {
    one.turned(SinCos { sin: other.beta, cos: other.alpha })
}

/// The unit vector of a direction.
#[inline(never)]
fn along(direction: Angle) -> AlphaBeta {
    let SinCos { sin, cos } = direction.sin_cos();
    AlphaBeta { alpha: cos, beta: sin }
}

/// The magnitude of a turn of less than half a turn.
fn off(turn: Angle) -> u32 {
    turn.signed().unsigned_abs()
}
