//! The steps of each machine's signals, and what a host and a drive of different steps make of each other.

use super::Stream;
use std::path::Path;
use tractive::built_in::traction::BUILT_IN;
use tractive::drive::dual::Settings;
use tractive::machine::{Ratings, Tables};
use tractive::protocol::e2e::Counter;
use tractive::protocol::{
    ANGLE_ZERO, COMMAND, CURRENTS, Command, Content, FROM_DRIVE, FROM_ZS9, Frame, Kind, LIMITS, LINK_LIMITS,
    LinkLimits, MOTION, Measured, Message, Payload, Quantity, Receiver, Reject, Scales, Signal, TO_DRIVE,
    TO_ZS9, TORQUE_ESTIMATE, TorqueLimits, VOLTAGES,
};
use tractive_tablegen::MachineFolder;

fn tables(name: &str) -> Tables {
    MachineFolder::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tables").join(name)).unwrap().tables()
}

/// Every machine of tables/.
fn machines() -> Vec<(String, Ratings)> {
    let folders = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("tables")).unwrap();
    let names = folders.map(|folder| folder.unwrap().file_name().into_string().unwrap());
    names.map(|name| (name.clone(), tables(&name).ratings)).collect()
}

/// The rating of a quantity, and the largest value of it that is to be told.
fn rated(ratings: &Ratings, signal: &Signal) -> [f32; 2] {
    let rpm = tractive::protocol::RPM_PER_RAD_S;
    let [speed, trip_speed] = [ratings.max_speed_rad_s, ratings.trip_speed_rad_s];
    let hz = ratings.pole_pairs / core::f32::consts::TAU;
    match signal.quantity {
        Quantity::Torque => [ratings.max_torque_nm, 1.4 * ratings.max_torque_nm],
        Quantity::Current => [ratings.max_current_a, ratings.trip_current_a],
        Quantity::Voltage => [ratings.dc_link_nominal_v, ratings.trip_dc_over_v],
        Quantity::Speed if signal.unit == "Hz" => [hz * speed, hz * trip_speed],
        Quantity::Speed => [rpm * speed, rpm * trip_speed],
        Quantity::Fixed => [f32::NAN; 2],
    }
}

/// Rounding costs 0.1 % of a rating at most, and values that trip the drive can still be told, on every machine of tables/ and on
/// machines that are a thousand times smaller and larger.
#[test]
fn rounding_is_small_beside_the_ratings() {
    let mut machines = machines();
    assert!(machines.len() >= 3);
    for (torque, current, speed) in
        [(1e-2, 0.05, 0.5), (1e-3, 0.1, 16.0), (20.0, 10.0, 0.1), (100.0, 5.0, 0.03)]
    {
        let (_, like) = machines[0];
        machines.push((
            format!("{torque} {current} {speed}"),
            Ratings {
                max_torque_nm: torque * like.max_torque_nm,
                max_current_a: current * like.max_current_a,
                trip_current_a: current * like.trip_current_a,
                max_speed_rad_s: speed * like.max_speed_rad_s,
                trip_speed_rad_s: speed * like.trip_speed_rad_s,
                ..like
            },
        ));
    }
    for (name, ratings) in &machines {
        let scales = Scales::of(ratings);
        let mut scaled = 0;
        for message in TO_DRIVE.into_iter().chain(FROM_DRIVE) {
            for signal in message.signals.iter().filter(|signal| signal.quantity != Quantity::Fixed) {
                scaled += 1;
                let step = signal.scale * scales.worth(signal.quantity);
                let [rating, most] = rated(ratings, signal);
                let text = format!("{name}: {}.{}: {step} of {rating}", message.name, signal.name);
                assert!(0.5 * step <= 1e-3 * rating, "{text}");
                for value in [0.37 * rating, rating, most] {
                    let mut payload = Payload(0);
                    signal.put_on(scales, &mut payload, value).unwrap_or_else(|_| panic!("{text}: {value}"));
                    let found = signal.get_on(scales, payload).unwrap();
                    assert!((found - value).abs() <= 0.5001 * step + 1e-6 * value, "{text}: {value} {found}");
                }
            }
        }
        assert_eq!(scaled, 15);
    }
}

/// The papers' machines have the usual steps, the one of 48 V finer ones.
#[test]
fn the_papers_machines_have_the_usual_steps() {
    for name in ["pmasynrm-180kw", "ipm-zs9"] {
        assert_eq!(Scales::of(&tables(name).ratings), Scales::USUAL, "{name}");
    }
    let low = Scales::of(&tables("pmsm-48v-1kw").ratings);
    assert_eq!(Quantity::SCALED.map(|quantity| low.exponent(quantity)), [-2, -1, -1, 0]);
    for message in TO_DRIVE.into_iter().chain(FROM_DRIVE) {
        assert_eq!(message.mark_signal(Scales::USUAL), None);
        assert_eq!(message.mark(Payload(77), Scales::USUAL), Payload(77));
        let is_scaled = message.signals.iter().any(|signal| signal.quantity != Quantity::Fixed);
        assert_eq!(message.mark_signal(low).is_some(), is_scaled, "{}", message.name);
    }
}

/// The ratings by which the ZS9's operator knows two such machines, and its scales.
fn on_a_zs9(ratings: &Ratings) -> (Ratings, Scales) {
    let operated = Settings::operator_ratings(ratings);
    (operated, Scales::of_zs9(&operated))
}

/// The same of two machines on a ZS9, whose capacitor has more volts than a machine's own link; the paper's have the usual steps.
#[test]
fn the_zs9_counts_in_its_machines_steps() {
    assert_eq!(on_a_zs9(&tables("ipm-zs9").ratings).1, Scales::USUAL);
    let (_, low) = on_a_zs9(&tables("pmsm-48v-1kw").ratings);
    assert_eq!(Quantity::SCALED.map(|quantity| low.exponent(quantity)), [-2, -1, 0, 0]);
    for (name, own) in machines() {
        let (operated, scales) = on_a_zs9(&own);
        let mut scaled = 0;
        for message in TO_ZS9.into_iter().chain(FROM_ZS9) {
            for signal in message.signals.iter().filter(|signal| signal.quantity != Quantity::Fixed) {
                scaled += 1;
                let step = signal.scale * scales.worth(signal.quantity);
                let [rating, most] = rated(&operated, signal);
                let most =
                    if signal.quantity == Quantity::Voltage { 1.4 * operated.dc_link_max_v } else { most };
                assert!(0.5 * step <= 1e-3 * rating, "{name}: {}.{}", message.name, signal.name);
                let mut payload = Payload(0);
                assert_eq!(signal.put_on(scales, &mut payload, most), Ok(()), "{name}: {}", signal.name);
            }
            let physical = message
                .signals
                .iter()
                .any(|signal| !["", "%", "deg"].contains(&signal.unit) && signal.quantity == Quantity::Fixed);
            assert!(!physical, "{}: a value whose steps are the same of every machine", message.name);
        }
        assert_eq!(scaled, 19);
    }
}

/// Any difference between two machines' steps is told by some message.
#[test]
fn steps_that_differ_are_told() {
    let usual = Scales::USUAL;
    for (quantity, ratings) in Quantity::SCALED.into_iter().zip(finer(&tables("ipm-zs9").ratings)) {
        let (_, other) = on_a_zs9(&ratings);
        assert_ne!(other.exponent(quantity), 0);
        let told = |message: &&Message| message.mark(Payload(0), usual) != message.mark(Payload(0), other);
        let messages: Vec<_> =
            TO_ZS9.into_iter().chain(FROM_ZS9).filter(told).map(|message| message.name).collect();
        assert!(!messages.is_empty(), "{}", quantity.name());
        println!("{}: {messages:?}", quantity.name());
    }
}

/// The ratings with another step of torque, of current, of voltage, of speed, and of no other quantity.
fn finer(ratings: &Ratings) -> [Ratings; 4] {
    [
        Ratings { max_torque_nm: 1.0, ..*ratings },
        Ratings { max_current_a: 1.0, trip_current_a: 1.3, ..*ratings },
        Ratings { dc_link_min_v: 3.0, dc_link_nominal_v: 4.0, dc_link_max_v: 5.0, ..*ratings },
        Ratings { max_speed_rad_s: 5.0, trip_speed_rad_s: 6.0, ..*ratings },
    ]
}

/// The bits that tell the scales lie where no signal is.
#[test]
fn the_mark_has_bits_of_its_own() {
    let low = Scales::of(&tables("pmsm-48v-1kw").ratings);
    for message in TO_DRIVE.into_iter().chain(FROM_DRIVE).chain(TO_ZS9).chain(FROM_ZS9) {
        if let Some(mark) = message.mark_signal(low) {
            assert!(
                message.signals.iter().all(|signal| signal.mask() & mark.mask() == 0),
                "{}",
                message.name
            );
            assert!(mark.start >= 12 && mark.kind == Kind::Unsigned && mark.min == mark.max);
        }
    }
}

/// Two frames of every message whose content has a scale, as a host on these scales sends them.
fn spoken(scales: Scales) -> Vec<[Frame; 2]> {
    let limits = TorqueLimits { motoring_nm: 1.0, braking_nm: 1.0, speed_rpm: 500.0 };
    let link = LinkLimits { low_v: 40.0, high_v: 55.0 };
    let contents: [(&'static Message, Payload); 3] = [
        (&COMMAND, Command { enable: true, torque_nm: 1.25, ..Command::default() }.encode(scales).unwrap()),
        (&LIMITS, limits.encode(scales).unwrap()),
        (&LINK_LIMITS, link.encode(scales).unwrap()),
    ];
    contents
        .map(|(message, content)| {
            let mut stream = Stream::of(message);
            [0; 2].map(|_| stream.frame(message.mark(content, scales)))
        })
        .to_vec()
}

/// The drive takes nothing from a host on other scales, and counts it as out of range; nor does a host take anything from such a drive.
#[test]
fn who_counts_in_other_steps_is_not_misread() {
    let own = [Scales::of(&BUILT_IN.ratings), Scales::of(&tables("pmsm-48v-1kw").ratings)];
    for (k, drive) in own.into_iter().enumerate() {
        for (j, host) in own.into_iter().enumerate() {
            let mut receiver = Receiver::new();
            for [first, second] in spoken(host) {
                assert_eq!(receiver.receive(&first, drive), Ok(Content::Greeting));
                let verdict = receiver.receive(&second, drive);
                if j == k {
                    assert!(verdict.is_ok(), "{second:?}");
                } else {
                    assert_eq!(verdict, Err(Reject::OutOfRange), "{second:?}");
                }
            }
            assert_eq!(receiver.counts().out_of_range, if j == k { 0 } else { 3 });
            for message in [&MOTION, &CURRENTS, &VOLTAGES, &TORQUE_ESTIMATE] {
                let frame = message.frame(message.mark(Payload(0), drive), &mut Counter::new());
                let payload = message.mark(Payload(u64::from_le_bytes(frame.data)), host);
                assert_eq!(message.is_tidy(payload), j == k, "{}", message.name);
            }
        }
    }
}

/// Whatever two machines' exponents are, a message tells them apart.
#[test]
fn every_difference_is_told() {
    let like = BUILT_IN.ratings;
    let shares = [1e-3_f32, 1e-2, 0.1, 1.0, 10.0];
    let mut all = vec![];
    for torque in shares {
        for current in shares {
            for volts in shares {
                for speed in shares {
                    all.push(Scales::of(&Ratings {
                        max_torque_nm: torque * like.max_torque_nm,
                        max_current_a: current * like.max_current_a,
                        trip_current_a: current * like.trip_current_a,
                        dc_link_nominal_v: volts * like.dc_link_nominal_v,
                        trip_dc_over_v: volts * like.trip_dc_over_v,
                        max_speed_rad_s: speed * like.max_speed_rad_s,
                        trip_speed_rad_s: speed * like.trip_speed_rad_s,
                        ..like
                    }));
                }
            }
        }
    }
    let marks = |messages: &[&Message], scales| {
        messages.iter().map(|message| message.mark(Payload(0), scales)).collect::<Vec<_>>()
    };
    for messages in [&TO_DRIVE[..3], &[&MOTION, &CURRENTS, &VOLTAGES, &TORQUE_ESTIMATE][..]] {
        for (k, first) in all.iter().enumerate() {
            for second in &all[..k] {
                let heard = |scales: Scales, quantity| {
                    // No current is sent to the drive.
                    let is_sent = quantity != Quantity::Current || messages.len() == 4;
                    if is_sent { scales.exponent(quantity) } else { 0 }
                };
                let differ = Quantity::SCALED.iter().any(|q| heard(*first, *q) != heard(*second, *q));
                assert_eq!(
                    differ,
                    marks(messages, *first) != marks(messages, *second),
                    "{first:?} {second:?}"
                );
            }
        }
    }
}

/// Measurements come as they were sent, within half a step.
#[test]
fn measurements_come_through() {
    let scales = Scales::of(&tables("pmsm-48v-1kw").ratings);
    let sent = Measured {
        speed_rpm: Some(-5_432.5),
        torque_nm: Some(-2.3456),
        torque_estimate_nm: Some(2.3444),
        link_v: Some(48.27),
        current_a: Some(29.994),
        id_ref_a: Some(-12.345),
        iq_ref_a: Some(27.001),
        voltage_v: Some(26.66),
        frequency_hz: Some(362.15),
        temperature_c: None,
        angle_zero_deg: Some(-123.45),
        calibrating: true,
    };
    let mut found = Measured::default();
    for (message, content) in [
        (&MOTION, sent.motion(scales)),
        (&CURRENTS, sent.currents(scales)),
        (&VOLTAGES, sent.voltages(scales)),
        (&TORQUE_ESTIMATE, sent.torque_estimate(scales)),
        (&ANGLE_ZERO, sent.angle_zero()),
    ] {
        found.merge(message, content, scales);
    }
    let near = |found: Option<f32>, sent: Option<f32>, step: f32| {
        assert!((found.unwrap() - sent.unwrap()).abs() <= 0.501 * step, "{found:?} {sent:?}");
    };
    near(found.speed_rpm, sent.speed_rpm, 0.5);
    near(found.torque_nm, sent.torque_nm, 0.001);
    near(found.torque_estimate_nm, sent.torque_estimate_nm, 0.001);
    near(found.link_v, sent.link_v, 0.01);
    near(found.current_a, sent.current_a, 0.01);
    near(found.id_ref_a, sent.id_ref_a, 0.01);
    near(found.iq_ref_a, sent.iq_ref_a, 0.01);
    near(found.voltage_v, sent.voltage_v, 0.01);
    near(found.frequency_hz, sent.frequency_hz, 0.05);
    near(found.angle_zero_deg, sent.angle_zero_deg, 0.01);
    assert!(found.calibrating);
}

/// Each exponent on either side of the rating at which it changes.
#[test]
fn a_scale_changes_where_steps_or_room_run_out() {
    type Change = fn(&mut Ratings, f32);
    let fast_poles: Change = |ratings, speed| (ratings.pole_pairs, ratings.trip_speed_rad_s) = (10.0, speed);
    let few_poles: Change = |ratings, speed| (ratings.pole_pairs, ratings.trip_speed_rad_s) = (1.0, speed);
    let quick = 1e3 / tractive::protocol::RPM_PER_RAD_S;
    let cases: [(Quantity, Change, [f32; 2], [i32; 2]); 9] = [
        (Quantity::Torque, |ratings, torque| ratings.max_torque_nm = torque, [49.9, 50.0], [-1, 0]),
        (Quantity::Torque, |ratings, torque| ratings.max_torque_nm = torque, [2_000.0, 2_000.1], [0, 1]),
        (Quantity::Current, |ratings, current| ratings.max_current_a = current, [49.9, 50.0], [-1, 0]),
        (Quantity::Current, |ratings, current| ratings.trip_current_a = current, [3_000.0, 3_000.1], [0, 1]),
        (Quantity::Voltage, |ratings, link| ratings.dc_link_nominal_v = link, [49.9, 50.0], [-1, 0]),
        (Quantity::Voltage, |ratings, link| ratings.trip_dc_over_v = link, [6_500.0, 6_500.1], [0, 1]),
        (
            Quantity::Speed,
            |ratings, speed| ratings.max_speed_rad_s = speed,
            [0.249 * quick, 0.251 * quick],
            [-1, 0],
        ),
        // 16,000 r/min, and 1,600 Hz.
        (Quantity::Speed, few_poles, [15.99 * quick, 16.01 * quick], [0, 1]),
        (Quantity::Speed, fast_poles, [9.599 * quick, 9.601 * quick], [0, 1]),
    ];
    for (quantity, change, ratings_at, exponents) in cases {
        let told = ratings_at.map(|value| {
            let (trip_current_a, trip_dc_over_v, trip_speed_rad_s) = (100.0, 100.0, 0.2 * quick);
            let mut ratings =
                Ratings { trip_current_a, trip_dc_over_v, trip_speed_rad_s, ..BUILT_IN.ratings };
            change(&mut ratings, value);
            Scales::of(&ratings).exponent(quantity)
        });
        assert_eq!(told, exponents, "{quantity:?} at {ratings_at:?}");
    }
    let zs9 = |dc_link_max_v: f32| {
        let ratings = Ratings { dc_link_max_v, ..BUILT_IN.ratings };
        Scales::of_zs9(&ratings).exponent(Quantity::Voltage)
    };
    assert_eq!([zs9(4_333.0), zs9(4_334.0)], [0, 1], "1.5 times that is 6,500 V");
}

/// Raw zero is the offset, and counts from there.
#[test]
fn a_signal_may_count_from_an_offset() {
    let signal = Signal { offset: 40.0, ..Signal::physical("t", "°C", 8, 0.5, [-10.0, 90.0]) };
    for (value, raw) in [(40.0, 0_u16), (45.0, 10), (39.5, 0xFFFF), (90.0, 100), (-10.0, 0xFF9C)] {
        let mut payload = Payload(0);
        signal.put(&mut payload, value).unwrap();
        assert_eq!(signal.raw(payload), raw.into(), "{value}");
        assert_eq!(signal.get(payload), Some(value));
    }
    let beyond = [101_u32, 0xFF9B].map(|raw| {
        let mut payload = Payload(0);
        signal.put_raw(&mut payload, raw);
        signal.get(payload)
    });
    assert_eq!(beyond, [None, None]);
}
