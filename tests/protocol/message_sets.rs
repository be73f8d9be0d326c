//! Message sets: the request that they make from what was sent, every level by itself, armed and not.

use tractive::built_in::traction::BUILT_IN;
use tractive::built_in::zs9;
use tractive::drive::dual::Settings as DualSettings;
use tractive::modulation::Mode;
use tractive::operator::{DualRequest, Levels, Limits, Request, Settings, Wanted};
use tractive::protocol::{
    CanEndpoint, Command, Content, MessageSet, ParameterRequest, Parameters, Pattern, Scales, Taken,
    TorqueLimits, Traction, ZS9_PARAMETER_REQUEST, Zs9, Zs9Command, Zs9Content, Zs9Demands,
};

const REST: Command = Command::AT_REST;

/// A command, and what shows that a request has it.
type Level = (Command, fn(&Request) -> bool);

/// Each level of a command by itself, and what a request then has.
fn levels() -> [Level; 7] {
    [
        (Command { enable: true, ..REST }, |request| request.enable),
        (Command { with_torque: true, ..REST }, |request| request.with_torque),
        (Command { off: true, ..REST }, |request| request.off),
        (Command { coast: true, ..REST }, |request| request.coast),
        (Command { charge: true, ..REST }, |request| request.charge),
        (Command { discharge: true, ..REST }, |request| request.discharge),
        (Command { acknowledge: true, ..REST }, |request| request.acknowledge),
    ]
}

#[test]
fn a_request_has_the_levels_of_the_command() {
    let ratings = &BUILT_IN.ratings;
    let parameters = Parameters::rated(ratings);
    for (place, (command, _)) in levels().into_iter().enumerate() {
        let mut set = Traction::SILENT;
        set.take(Content::Command(Command { torque_nm: 70.0, ..command }));
        let of = |set: &Traction, armed, fresh| {
            let request = set.request(armed, fresh, &parameters, ratings);
            (levels().map(|(_, is_set)| is_set(&request)), request.torque_nm)
        };
        let mut own = [false; 7];
        own[place] = true;
        assert_eq!(of(&set, true, true), (own, 70.0), "{command:?}");
        assert_eq!(of(&set, true, false), (own, 0.0), "an old command has levels alone");
        // Before it is armed the drive is only switched off.
        own = [false; 7];
        own[2] = place == 2;
        assert_eq!(of(&set, false, true), (own, 0.0), "{command:?}");
        set.rest();
        assert_eq!(of(&set, true, true), ([false; 7], 0.0));
    }
}

#[test]
fn limits_are_the_lower_of_what_is_sent_and_the_parameters() {
    let ratings = &BUILT_IN.ratings;
    let rated = Parameters::rated(ratings);
    let rpm = tractive::protocol::RPM_PER_RAD_S;
    let parameters = Parameters { torque_limit_nm: 500.0, speed_limit_rpm: 2_000.0, ..rated };
    let limits = |sent: Option<TorqueLimits>, parameters: &Parameters| {
        let mut set = Traction::SILENT;
        sent.into_iter().for_each(|sent| assert!(matches!(set.take(Content::Limits(sent)), Taken::Kept)));
        let Limits { motoring_nm, braking_nm, speed_rad_s, .. } =
            set.request(true, true, parameters, ratings).limits;
        [motoring_nm, braking_nm, (speed_rad_s * rpm).round()]
    };
    assert_eq!(limits(None, &parameters), [500.0, 500.0, 2_000.0]);
    for (motoring_nm, braking_nm, speed_rpm, wanted) in [
        (400.0, 300.0, 1_000.0, [400.0, 300.0, 1_000.0]),
        (600.0, 700.0, 3_000.0, [500.0, 500.0, 2_000.0]),
        // Beyond the rating: for the operator to refuse.
        (9_000.0, 8_000.0, 90_000.0, [9_000.0, 8_000.0, 90_000.0]),
    ] {
        assert_eq!(limits(Some(TorqueLimits { motoring_nm, braking_nm, speed_rpm }), &parameters), wanted);
    }
    // A rating that was rounded on its way is the rating.
    let most = ratings.max_speed_rad_s;
    let rounded = TorqueLimits { motoring_nm: 1.0, braking_nm: 1.0, speed_rpm: most * rpm * 1.00005 };
    let mut set = Traction::SILENT;
    set.take(Content::Limits(rounded));
    let wide = Parameters { speed_limit_rpm: most * rpm * 1.00005, ..rated };
    assert_eq!(set.request(true, true, &wide, ratings).limits.speed_rad_s, most);
}

#[test]
fn the_zs9s_request_has_the_levels_of_its_command() {
    let ratings = DualSettings::operator_ratings(&zs9::BUILT_IN.ratings);
    let parameters = Parameters::rated(&ratings);
    let none = Levels::NONE;
    for levels in [
        Levels { enable: true, ..none },
        Levels { with_torque: true, ..none },
        Levels { off: true, ..none },
        Levels { coast: true, ..none },
        Levels { charge: true, ..none },
        Levels { discharge: true, ..none },
        Levels { acknowledge: true, ..none },
    ] {
        let mut set = Zs9::SILENT;
        let demands = Zs9Demands::Torques([3.0, -4.0]);
        let taken = set.take(Zs9Content::Command(Zs9Command { levels, demands }));
        let at_rest = levels.off;
        assert!(matches!(taken, Taken::Command { at_rest: told } if told == at_rest), "{levels:?}");
        let of = |set: &Zs9, armed| {
            let DualRequest { levels, motors, .. } = set.request(armed, true, &parameters, &ratings);
            (levels, motors.map(|motor| motor.wanted))
        };
        let rest = [Wanted::Torque(0.0); 2];
        assert_eq!(of(&set, true), (levels, [Wanted::Torque(3.0), Wanted::Torque(-4.0)]));
        assert_eq!(of(&set, false), (Levels { off: levels.off, ..none }, rest), "{levels:?}");
        set.rest();
        assert_eq!(of(&set, true), (none, rest));
    }
}

#[test]
fn the_zs9_takes_requests_of_parameters_by_their_identifier() {
    let request = ParameterRequest { parameter: 3, write: None };
    let payload = request.encode().unwrap();
    let decoded = Zs9::decode(ZS9_PARAMETER_REQUEST.id, payload, Scales::USUAL);
    assert!(matches!(decoded, Some(Zs9Content::Parameter(told)) if told == request), "{decoded:?}");
    assert!(Zs9::decode(0x7FF, payload, Scales::USUAL).is_none());
    assert!(
        Zs9::decode(ZS9_PARAMETER_REQUEST.id ^ 1, payload, Scales::USUAL)
            .is_none_or(|content| { !matches!(content, Zs9Content::Parameter(_)) })
    );
}

#[test]
fn parameters_are_in_the_operators_settings() {
    let endpoint = CanEndpoint::new(&BUILT_IN.ratings);
    let usual = Settings::rated(&BUILT_IN.ratings, 1e-3, None);
    let mut other = usual;
    (other.slew_nm_s, other.jerk_nm_s2) = (1.0, 2.0);
    let got = endpoint.settings(&other);
    let parameters = Parameters::rated(&BUILT_IN.ratings);
    assert_eq!(
        (got.slew_nm_s, got.jerk_nm_s2, got.slot_s),
        (parameters.torque_slew_nm_s, parameters.torque_jerk_nm_s2, 1e-3)
    );
}

#[test]
fn a_mode_comes_back_from_its_code() {
    for mode in Mode::ALL {
        assert_eq!(<Mode as Pattern>::from_code(mode.code()), mode);
    }
}
