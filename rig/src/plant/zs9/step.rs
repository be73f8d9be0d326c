//! One Runge–Kutta step of network and motors together.

use super::bridge::{Bridge, LegGates, freewheeling};
use super::drops::{Devices, Lost};
use super::means::Seen;
use super::network::NetworkState;
use super::{Vector, Zs9Plant};
use crate::plant::runge_kutta::{along, rotated};
use crate::plant::{StatorSlopes, Turning};

/// The feed of the network on the source's side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feed {
    /// The source: `u_s = U_dc`.
    Source,
    /// Nothing, while the bridge is a short, through its gates or its diodes: `u_s = v1 + v2`.
    Short,
    /// Nothing, while the bridge takes all of the inductors' current: u_s is the voltage that keeps `i1 + i2 = i_in`.
    Blocked,
    /// The source, while the bridge's diodes keep the link from reversing: `U_in = 0`, so `v1 + v2 = U_dc` stays as it is, and the bridge takes half
    /// of the inductors' current.
    Clamped,
}

/// id and iq of the upper motor, of the lower one; i1, i2; v1, v2.
type State = [f64; 8];
/// Electrical energy, copper loss and the torque's impulse of the upper motor, then of the lower one. Then energy from the source, loss of the
/// inductors, loss of the devices.
type Sums = [f64; 9];

/// A motor's rotor frame at an instant.
#[derive(Clone, Copy)]
struct Frame {
    sin_cos: (f64, f64),
    omega: f64,
    /// The terminals' shares of the link, in this frame.
    share: (f64, f64),
}

/// A step that has been computed but not yet taken.
pub struct Trial {
    dt_s: f64,
    state: State,
    sums: Sums,
    /// The state's integral over the step.
    area: State,
    end: [Frame; 2],
}

impl Zs9Plant {
    fn state(&self) -> State {
        let [upper, lower] = &self.motors;
        let ([i1, i2], [v1, v2]) = (self.network.inductors_a, self.network.capacitors_v);
        [upper.id_a, upper.iq_a, lower.id_a, lower.iq_a, i1, i2, v1, v2]
    }

    /// Runge–Kutta, fourth order. The frames turn during the step; the speeds change linearly at most.
    pub(super) fn try_step(&self, bridge: &Bridge, feed: Feed, dt_s: f64) -> Trial {
        let turning = both(|k| self.motors[k].rotor.turning(|| self.motors[k].torque_nm(), dt_s));
        let begin = both(|k| self.motors[k].rotor.sin_cos());
        let after = |t: f64| both(|k| turned(begin[k], turning[k].turned(t)));
        let half = 0.5 * dt_s;
        let (middle, end) = (after(half), after(dt_s));
        let (f0, f1, f2) = (
            frames(bridge, begin, &turning, 0.0),
            frames(bridge, middle, &turning, half),
            frames(bridge, end, &turning, dt_s),
        );
        let y0 = self.state();
        let (k1, s1) = self.rates(&y0, &f0, bridge, feed);
        let (k2, s2) = self.rates(&along(&y0, &k1, half), &f1, bridge, feed);
        let (k3, s3) = self.rates(&along(&y0, &k2, half), &f1, bridge, feed);
        let (k4, s4) = self.rates(&along(&y0, &k3, dt_s), &f2, bridge, feed);
        let mut state = y0;
        let (mut sums, mut area) = ([0.0; 9], [0.0; 8]);
        for k in 0..8 {
            area[k] = dt_s * (y0[k] + dt_s / 6.0 * (k1[k] + k2[k] + k3[k]));
            state[k] += dt_s / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]);
        }
        for k in 0..9 {
            sums[k] = dt_s / 6.0 * (s1[k] + 2.0 * (s2[k] + s3[k]) + s4[k]);
        }
        Trial { dt_s, state, sums, area, end: f2 }
    }

    /// Takes the step.
    pub(super) fn take(&mut self, trial: &Trial) {
        let Trial { dt_s, state, sums, area, .. } = *trial;
        let before = self.seen();
        for (k, motor) in self.motors.iter_mut().enumerate() {
            let energies = [sums[3 * k], sums[3 * k + 1], sums[3 * k + 2]];
            motor.finish([state[2 * k], state[2 * k + 1]], energies, dt_s);
        }
        self.network = NetworkState { inductors_a: [state[4], state[5]], capacitors_v: [state[6], state[7]] };
        self.energies.source_j += sums[6];
        self.energies.inductors_j += sums[7];
        self.energies.devices_j += sums[8];
        self.time_s += dt_s;
        self.means.add(dt_s, &area, [sums[2], sums[5]], &before, &self.seen());
    }

    /// The values at a step's end that enter the means.
    fn seen(&self) -> [Seen; 2] {
        both(|k| {
            let motor = &self.motors[k];
            let vector = Vector::from_rotor((motor.id_a, motor.iq_a), motor.rotor.sin_cos());
            Seen { vector, speed_rpm: motor.rotor.speed_rpm() }
        })
    }

    /// The excess of the inductors' current over the current that the bridge's gates ask for, in A: the source gives it, or, if negative, the
    /// bridge's diodes take up the difference.
    pub(super) fn excess_a(&self, bridge: &Bridge) -> f64 {
        let y = self.state();
        let still = self.still(bridge);
        y[4] + y[5] - self.demand(&y, &self.shares(&y, &still, bridge))
    }

    /// That excess after a step.
    pub(super) fn excess_after(&self, bridge: &Bridge, trial: &Trial) -> f64 {
        let y = &trial.state;
        y[4] + y[5] - self.demand(y, &self.shares(y, &trial.end, bridge))
    }

    /// The excess of half of the inductors' current over the current that the bridge's gates ask for, in A: if positive the link rises; if negative it falls.
    pub(super) fn rising_a(&self, bridge: &Bridge) -> f64 {
        let y = self.state();
        0.5 * (y[4] + y[5]) - self.demand(&y, &self.shares(&y, &self.still(bridge), bridge))
    }

    /// That after a step.
    pub(super) fn rising_after(&self, bridge: &Bridge, trial: &Trial) -> f64 {
        let y = &trial.state;
        0.5 * (y[4] + y[5]) - self.demand(y, &self.shares(y, &trial.end, bridge))
    }

    /// The link's voltage now, in V, while this path feeds it; in shoot-through that outside it.
    pub(super) fn link_now_v(&self, bridge: &Bridge, feed: Feed) -> f64 {
        match feed {
            Feed::Blocked => {
                let (y, still) = (self.state(), self.still(bridge));
                let shares = (self.shares(&y, &still, bridge), self.lost(&y, &still, bridge).0);
                y[6] + y[7] - self.holding_feed_v(&y, &still, &shares)
            }
            Feed::Short if *bridge != Bridge::Short => 0.0,
            Feed::Source | Feed::Short | Feed::Clamped => self.link_v(),
        }
    }

    /// `U_in` after a step that the source fed, in V.
    pub(super) fn link_after_v(&self, trial: &Trial) -> f64 {
        trial.state[6] + trial.state[7] - self.source_v
    }

    /// The link voltage at which that excess stays constant, as a share of the link's voltage under the source.
    pub(super) fn holding_share(&self, bridge: &Bridge) -> f64 {
        let y = self.state();
        let still = self.still(bridge);
        let shares = (self.shares(&y, &still, bridge), self.lost(&y, &still, bridge).0);
        let capacitors_v = y[6] + y[7];
        (capacitors_v - self.holding_feed_v(&y, &still, &shares)) / (capacitors_v - self.source_v)
    }

    /// The frames now.
    fn still(&self, bridge: &Bridge) -> [Frame; 2] {
        let turning = both(|k| self.motors[k].rotor.turning(|| 0.0, 1.0));
        frames(bridge, both(|k| self.motors[k].rotor.sin_cos()), &turning, 0.0)
    }

    // Each step needs four of them, which is most of a run: they are compiled into it, whatever they are compiled for.
    #[inline(always)]
    fn rates(&self, y: &State, frames: &[Frame; 2], bridge: &Bridge, feed: Feed) -> (State, Sums) {
        let shares = self.shares(y, frames, bridge);
        let network = NetworkState { inductors_a: [y[4], y[5]], capacitors_v: [y[6], y[7]] };
        let (capacitors_v, inductors_a) = (y[6] + y[7], y[4] + y[5]);
        let (lost, short_v) = self.lost(y, frames, bridge);
        let (feed_v, bridge_a) = match feed {
            Feed::Source => {
                let demand_a = self.demand(y, &shares);
                (self.feed_v(inductors_a - demand_a), demand_a)
            }
            Feed::Short => (capacitors_v - short_v, inductors_a),
            Feed::Blocked => (self.holding_feed_v(y, frames, &(shares, lost)), inductors_a),
            Feed::Clamped => (self.source_v, 0.5 * inductors_a),
        };
        let link_v = if feed == Feed::Short { short_v } else { capacitors_v - feed_v };
        let upper = self.motor_slopes(0, y, frames, &(shares, lost), link_v);
        let lower = self.motor_slopes(1, y, frames, &(shares, lost), link_v);
        let slopes = self.parts.slopes(&network, feed_v, bridge_a);
        let ([di1, di2], [dv1, dv2]) = (slopes.inductors_a, slopes.capacitors_v);
        let fed_a = inductors_a - bridge_a;
        let source_w = if feed == Feed::Source { self.source_v } else { feed_v } * fed_a;
        let lost_w = self.drops.map_or(0.0, |_| {
            source_w - feed_v * fed_a + link_v * bridge_a - upper.electrical_w - lower.electrical_w
        });
        (
            [upper.id_a_s, upper.iq_a_s, lower.id_a_s, lower.iq_a_s, di1, di2, dv1, dv2],
            [
                upper.electrical_w,
                upper.copper_w,
                upper.torque_nm,
                lower.electrical_w,
                lower.copper_w,
                lower.torque_nm,
                source_w,
                self.parts.loss_w(&network),
                lost_w,
            ],
        )
    }

    /// The voltage on the source's side behind its switch, in V, at the source's current, in A.
    #[inline]
    fn feed_v(&self, source_a: f64) -> f64 {
        self.devices().map_or(self.source_v, |devices| self.source_v - devices.source_v(source_a))
    }

    /// The devices, unless they are ideal.
    #[inline]
    fn devices(&self) -> Option<Devices<'_>> {
        self.drops.as_ref().map(|drops| Devices { drops, clamp: &self.clamp })
    }

    /// The voltages that the bridge's devices take from both motors, in the rotor frames, and the link's voltage in shoot-through.
    #[inline]
    fn lost(&self, y: &State, frames: &[Frame; 2], bridge: &Bridge) -> (Shares, f64) {
        let Some(devices) = self.devices() else { return ([(0.0, 0.0); 2], 0.0) };
        let currents = both(|k| Vector::from_rotor((y[2 * k], y[2 * k + 1]), frames[k].sin_cos).phases());
        let Lost { terminals, short_v } = match bridge {
            Bridge::Driven(_) => devices.driven(&self.gates, currents),
            Bridge::Short => devices.shorted(&self.gates, currents, y[4] + y[5]),
            Bridge::Off | Bridge::Partly(_) => Lost::default(),
        };
        (both(|k| terminals[k].to_rotor(frames[k].sin_cos)), short_v)
    }

    #[inline(always)]
    fn motor_slopes(
        &self,
        k: usize,
        y: &State,
        frames: &[Frame; 2],
        (shares, lost): &(Shares, Shares),
        link_v: f64,
    ) -> StatorSlopes {
        let ((d, q), (lost_d, lost_q)) = (shares[k], lost[k]);
        let stator = &self.motors[k].stator;
        let volts = (link_v * d - lost_d, link_v * q - lost_q);
        stator.slopes((y[2 * k], y[2 * k + 1]), volts, frames[k].omega)
    }

    /// The terminals' shares of the link, in the rotor frames.
    #[inline(always)]
    fn shares(&self, y: &State, frames: &[Frame; 2], bridge: &Bridge) -> Shares {
        let gates = match bridge {
            Bridge::Off => [LegGates::OFF; 3],
            Bridge::Partly(gates) => *gates,
            Bridge::Driven(_) | Bridge::Short => return [frames[0].share, frames[1].share],
        };
        let [upper, lower] =
            both(|k| Vector::from_rotor((y[2 * k], y[2 * k + 1]), frames[k].sin_cos).phases());
        let stationary = freewheeling(&self.clamp, &gates, upper, lower);
        both(|k| stationary[k].to_rotor(frames[k].sin_cos))
    }

    /// The current that the motors draw from the link, in A: `1.5 (s·i)` of both.
    #[inline]
    fn demand(&self, y: &State, shares: &Shares) -> f64 {
        let [(d1, q1), (d2, q2)] = *shares;
        1.5 * (d1 * y[0] + q1 * y[1] + d2 * y[2] + q2 * y[3])
    }

    /// The voltage on the source's side that keeps `i1 + i2` equal to what the motors draw, in V.
    ///
    /// The motors' draw changes at a rate `a + b U_in`, the inductors' sum at `(2 u_s − v1 − v2 − r (i1 + i2))/L`, and
    /// `U_in = v1 + v2 − u_s`.
    fn holding_feed_v(&self, y: &State, frames: &[Frame; 2], shares: &(Shares, Shares)) -> f64 {
        let draw_rate = |link_v: f64| -> f64 {
            (0..2)
                .map(|k| {
                    let slopes = self.motor_slopes(k, y, frames, shares, link_v);
                    let ((d, q), omega) = (shares.0[k], frames[k].omega);
                    // The shares are constant while the frame turns.
                    1.5 * (d * (slopes.id_a_s - omega * y[2 * k + 1])
                        + q * (slopes.iq_a_s + omega * y[2 * k]))
                })
                .sum()
        };
        let a = draw_rate(0.0);
        let b = draw_rate(1.0) - a;
        let (capacitors_v, inductors_a) = (y[6] + y[7], y[4] + y[5]);
        let inductance = self.parts.inductance_h;
        (capacitors_v + self.parts.resistance_ohm * inductors_a + inductance * (a + b * capacitors_v))
            / (2.0 + inductance * b)
    }
}

/// The terminals' shares of the link for both motors, d and q.
type Shares = [(f64, f64); 2];

/// Both frames at a time after the step's beginning.
#[inline(always)]
fn frames(bridge: &Bridge, sin_cos: [(f64, f64); 2], turning: &[Turning; 2], t_s: f64) -> [Frame; 2] {
    let stationary = match bridge {
        Bridge::Driven(shares) => *shares,
        Bridge::Short | Bridge::Off | Bridge::Partly(_) => [Vector::default(); 2],
    };
    both(|k| Frame {
        sin_cos: sin_cos[k],
        omega: turning[k].omega(t_s),
        share: stationary[k].to_rotor(sin_cos[k]),
    })
}

/// The same for the upper motor and for the lower one; an array's `map` is not inlined.
#[inline(always)]
fn both<T>(of: impl Fn(usize) -> T) -> [T; 2] {
    [of(0), of(1)]
}

/// Sine and cosine after a rotation by an angle in rad.
#[inline]
fn turned(from: (f64, f64), by: f64) -> (f64, f64) {
    rotated(from, small_sin_cos(by))
}

/// Sine and cosine; the small angle of a step uses a series that is exact to rounding.
#[inline]
fn small_sin_cos(x: f64) -> (f64, f64) {
    const SMALL: f64 = 0.05;
    if x.abs() > SMALL {
        return libm::sincos(x);
    }
    let z = x * x;
    let sin = x * (1.0 - z / 6.0 * (1.0 - z / 20.0 * (1.0 - z / 42.0)));
    let cos = 1.0 - z / 2.0 * (1.0 - z / 12.0 * (1.0 - z / 30.0 * (1.0 - z / 56.0)));
    (sin, cos)
}

#[cfg(test)]
mod tests {
    use super::small_sin_cos;

    #[test]
    fn small_angles_are_exact_to_rounding() {
        for k in -100..=100 {
            let x = f64::from(k) * 6e-4;
            let (sin, cos) = small_sin_cos(x);
            assert!((sin - x.sin()).abs() < 1e-17 && (cos - x.cos()).abs() < 2e-16, "{x}");
        }
    }
}
