//! The blocks, each in a function of its name (`sin_cos/idsp` in `sin_cos_idsp`). None is inlined: the instructions from a block's first to its return
//! are counted.

use crate::{Block, Input, Output, exact};
use fixed::types::I16F16;
use micromath::F32Ext;
use tractive::built_in::traction::BUILT_IN;
use tractive::control::{flux_linkage, mtpa};
use tractive::frames::{self, Abc, Angle, Dq, SinCos};

/// Every block; of those with the same word before the slash, the first is ours.
pub const ALL: [Block; 20] = [
    Block { name: "call/nothing", run: call_nothing, exact: None },
    Block { name: "sin_cos/tractive", run: sin_cos_tractive, exact: Some(exact::sin_cos) },
    Block { name: "sin_cos/idsp", run: sin_cos_idsp, exact: Some(exact::sin_cos) },
    Block { name: "sin_cos/micromath", run: sin_cos_micromath, exact: Some(exact::sin_cos) },
    Block { name: "sin_cos/fluxkit", run: sin_cos_fluxkit, exact: Some(exact::sin_cos) },
    Block { name: "sin_cos/libm", run: sin_cos_libm, exact: Some(exact::sin_cos) },
    Block { name: "atan2/tractive", run: atan2_tractive, exact: Some(exact::direction) },
    Block { name: "atan2/idsp", run: atan2_idsp, exact: Some(exact::direction) },
    Block { name: "atan2/micromath", run: atan2_micromath, exact: Some(exact::direction) },
    Block { name: "atan2/libm", run: atan2_libm, exact: Some(exact::direction) },
    Block { name: "sqrt/tractive", run: sqrt_tractive, exact: Some(exact::root) },
    Block { name: "sqrt/micromath", run: sqrt_micromath, exact: Some(exact::root) },
    Block { name: "sqrt/libm", run: sqrt_libm, exact: Some(exact::root) },
    Block { name: "lookup_2d/tractive", run: lookup_2d_tractive, exact: Some(exact::flux) },
    Block { name: "clarke_park/tractive", run: clarke_park_tractive, exact: None },
    Block { name: "mtpa/tractive", run: mtpa_tractive, exact: None },
    Block { name: "core_tick/tractive", run: core_tick_tractive, exact: None },
    Block { name: "core_tick/foc", run: core_tick_foc, exact: None },
    Block { name: "core_tick/fluxkit", run: core_tick_fluxkit, exact: None },
    Block { name: "duty_tick/tractive", run: duty_tick_tractive, exact: None },
];

/// The overhead of every block besides its own work: the call's return, two values read and two written.
#[inline(never)]
fn call_nothing(input: &Input, output: &mut Output) {
    *output = input.vector;
}

#[inline(never)]
fn sin_cos_tractive(input: &Input, output: &mut Output) {
    let result = Angle(input.turn).sin_cos();
    *output = [result.sin, result.cos];
}

#[inline(never)]
fn sin_cos_idsp(input: &Input, output: &mut Output) {
    const SCALE: f32 = 1.0 / 2_147_483_648.0;
    let (cos, sin) = idsp::cossin(input.turn.cast_signed());
    *output = [sin as f32 * SCALE, cos as f32 * SCALE];
}

#[inline(never)]
fn sin_cos_micromath(input: &Input, output: &mut Output) {
    let (sin, cos) = F32Ext::sin_cos(input.radians);
    *output = [sin, cos];
}

#[inline(never)]
fn sin_cos_fluxkit(input: &Input, output: &mut Output) {
    let (sin, cos) = fluxkit_math::trig::sin_cos(input.radians);
    *output = [sin, cos];
}

#[inline(never)]
fn sin_cos_libm(input: &Input, output: &mut Output) {
    let (sin, cos) = libm::sincosf(input.radians);
    *output = [sin, cos];
}

#[inline(never)]
fn atan2_tractive(input: &Input, output: &mut Output) {
    let [x, y] = input.vector;
    *output = [Angle::of_vector(x, y).signed_radians(), 0.0];
}

#[inline(never)]
fn atan2_idsp(input: &Input, output: &mut Output) {
    let [x, y] = input.integers;
    let angle = idsp::atan2(y, x);
    *output = [angle as f32 * (core::f32::consts::PI / 2_147_483_648.0), 0.0];
}

#[inline(never)]
fn atan2_micromath(input: &Input, output: &mut Output) {
    let [x, y] = input.vector;
    *output = [F32Ext::atan2(y, x), 0.0];
}

#[inline(never)]
fn atan2_libm(input: &Input, output: &mut Output) {
    let [x, y] = input.vector;
    *output = [libm::atan2f(y, x), 0.0];
}

#[inline(never)]
fn sqrt_tractive(input: &Input, output: &mut Output) {
    *output = [frames::sqrt(input.positive), 0.0];
}

#[inline(never)]
fn sqrt_micromath(input: &Input, output: &mut Output) {
    *output = [F32Ext::sqrt(input.positive), 0.0];
}

#[inline(never)]
fn sqrt_libm(input: &Input, output: &mut Output) {
    *output = [libm::sqrtf(input.positive), 0.0];
}

#[inline(never)]
fn lookup_2d_tractive(input: &Input, output: &mut Output) {
    let [d, q] = input.current_a;
    let flux = flux_linkage(&BUILT_IN, Dq { d, q });
    *output = [flux.d, flux.q];
}

#[inline(never)]
fn clarke_park_tractive(input: &Input, output: &mut Output) {
    let current = currents(input).clarke().park(Angle(input.turn).sin_cos());
    *output = [current.d, current.q];
}

#[inline(never)]
fn mtpa_tractive(input: &Input, output: &mut Output) {
    let point = mtpa(input.positive, &BUILT_IN);
    *output = [point.d, point.q];
}

const GAIN: f32 = 900.0;
const INTEGRAL_GAIN: f32 = 20.0;
const RESISTANCE: f32 = 0.1;
const LINK_V: f32 = 100.0;

/// The voltage of every field-oriented controller, in this drive's way: Clarke, Park, current to flux by the map, the flux error with its integral part,
/// decoupling. The rotor's frame, the integral part and the voltage.
#[inline(always)]
fn controlled(input: &Input, output: &Output) -> (SinCos, Dq, Dq) {
    let frame = Angle(input.turn).sin_cos();
    let current = currents(input).clarke().park(frame);
    let flux = flux_linkage(&BUILT_IN, current);
    let [d, q] = input.vector;
    let error = Dq { d, q } - flux;
    let integral = Dq { d: output[0], q: output[1] } + error * INTEGRAL_GAIN;
    (frame, integral, error * GAIN + integral + flux.j() * input.radians + current * RESISTANCE)
}

/// The tick of every field-oriented controller: that voltage, back to the stator, as voltages of the phases.
#[inline(never)]
fn core_tick_tractive(input: &Input, output: &mut Output) {
    let (frame, _, voltage) = controlled(input, output);
    let phases = voltage.unpark(frame).abc();
    *output = [phases.a, phases.b];
}

/// The same, continued to three duties: within the circle of the largest voltage, the integral part held back by what that limit cuts off, the phases
/// centred by the zero sequence.
#[inline(never)]
fn duty_tick_tractive(input: &Input, output: &mut Output) {
    const LIMIT_V: f32 = LINK_V * 0.577_350_3;
    let (frame, integral, wanted) = controlled(input, output);
    let squared = wanted.d * wanted.d + wanted.q * wanted.q;
    let fits = squared <= LIMIT_V * LIMIT_V;
    let voltage = if fits { wanted } else { wanted * (LIMIT_V / frames::sqrt(squared)) };
    let kept = integral + (voltage - wanted) * (INTEGRAL_GAIN / GAIN);
    let Abc { a, b, c } = voltage.unpark(frame).abc();
    let larger = |x: f32, y: f32| if x > y { x } else { y };
    let smaller = |x: f32, y: f32| if x < y { x } else { y };
    let centre = 0.5 * (larger(a, larger(b, c)) + smaller(a, smaller(b, c)));
    let [a, b, c] = [a, b, c].map(|phase| 0.5 + (phase - centre) * (1.0 / LINK_V));
    // The third duty and the integral part are stored as well.
    core::hint::black_box((c, kept));
    *output = [a, b];
}

/// The tick of the crate `foc`, in fixed point: no map, no decoupling, compare values by space vectors.
#[inline(never)]
fn core_tick_foc(input: &Input, output: &mut Output) {
    use foc::{Foc, pid::PIController, pwm::SpaceVector};
    let number = |x: f32| I16F16::from_bits((x * 65_536.0) as i32);
    let controller = || PIController::new(I16F16::ONE, I16F16::ONE);
    let mut foc = Foc::<SpaceVector, 4096>::new(controller(), controller());
    let Abc { a, b, .. } = currents(input);
    let angle = number(input.radians);
    let compare = foc.update([number(a), number(b)], angle, I16F16::ONE, I16F16::DELTA);
    *output = [f32::from(compare[0]), f32::from(compare[1])];
}

/// That of `fluxkit_math`: no map, no decoupling, each axis within its limits, duties.
#[inline(never)]
fn core_tick_fluxkit(input: &Input, output: &mut Output) {
    use fluxkit_math::frame;
    use fluxkit_math::modulation::svpwm;
    use fluxkit_math::transforms::{clarke, inverse_park, park};
    use fluxkit_math::{PiConfig, PiController};
    const PERIOD_S: f32 = 1e-4;
    let controller = || PiController::new(PiConfig { kp: 1.0, ki: 10.0, out_min: -50.0, out_max: 50.0 });
    let Abc { a, b, c } = currents(input);
    let current = park(clarke(frame::Abc::new(a, b, c)), input.radians);
    let [d, q] = input.vector;
    let voltage = frame::Dq::new(
        controller().update(d - current.d, PERIOD_S),
        controller().update(q - current.q, PERIOD_S),
    );
    let duty = svpwm(inverse_park(voltage, input.radians), LINK_V).duty;
    *output = [duty.a.get(), duty.b.get()];
}

fn currents(input: &Input) -> Abc {
    let [a, b] = input.vector;
    Abc { a, b, c: -a - b }
}
