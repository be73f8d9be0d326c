//! Commands that must not end in an accident: sessions are typed in over the protocol, and the machine's course is judged.

use std::io::Write;
use std::process::{Command, Stdio};

/// The largest and the last value of a column of the trace of a session, by magnitude and with its sign.
fn course(system: &str, options: &[&str], column: &str, commands: &str) -> (f64, f64) {
    let out = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
    command.args(["talk", "-", "--system", system, "--dt", "1e-3", "--out"]).arg(out.path()).args(options);
    let mut child =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(commands.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut reader = csv::Reader::from_path(out.path().join("trace.csv")).unwrap();
    let at = reader.headers().unwrap().iter().position(|name| name == column).unwrap();
    let values = reader.records().map(|row| row.unwrap()[at].parse::<f64>().unwrap());
    values.fold((0.0, 0.0), |(largest, _), value| (f64::max(largest, value.abs()), value))
}

/// With and without the link that braking has raised: what square wave was filled to at a higher speed is not asked for at a lower one. It ended in
/// `overcurrent` with 308 A.
#[test]
fn a_machine_that_has_slowed_down_is_caught_without_current() {
    for commands in [
        "0.3 charge\n3.2 enable\n3.4 torque 1235 over 0.1\n5.45 torque -200 over 0.1\n5.65 torque 0 over 0.05\n5.75 load 100\n\
         5.75 disable\n5.9 load 1200\n6.85 load 0\n7.0 enable\n7.5 expect fault none\n7.5 end\n",
        "0.3 charge\n3.2 enable\n3.4 torque 1235 over 0.1\n5.63 torque 20 over 0.1\n6.3 off on\n6.4 torque 0 over 0.05\n6.4 load 1200\n\
         6.5 disable\n6.6 off off\n7.59 load 0\n7.62 acknowledge\n7.7 enable\n8.2 expect fault none\n8.2 end\n",
    ] {
        let (_, last) = course("pmasynrm", &["--inertia", "4"], "speed_rpm", commands);
        assert!((700.0..2_500.0).contains(&last), "{last} r/min");
    }
}

/// A link above its window, and a line that takes no power: neither lets a train roll back.
#[test]
fn a_train_starts_on_a_hill() {
    for (options, begins) in [
        (["--inertia", "40"], "2.2 link-limits 1000 1480\n2.3 enable\n"),
        (["--inertia", "94"], "1.9 write 10 0\n2.0 write 10 0\n2.3 enable\n"),
    ] {
        let commands = format!(
            "0.2 charge\n{begins}2.4 load 300\n2.4 torque 600 over 0.2\n6 expect torque_nm 600 within 1\n6 end\n"
        );
        let (_, last) = course("pmasynrm", &options, "speed_rpm", &commands);
        assert!(last > 10.0, "{begins}: {last} r/min");
    }
}

/// The ramp of the demand is slower than a free rotor, and a train's comfort slower still.
#[test]
fn no_torque_drives_a_motor_beyond_its_speed_limit() {
    let slow = "0.2 charge\n1.9 write 1 500\n2.0 write 1 500\n2.1 write 2 500\n2.2 limits 1235 1235 500\n2.3 enable\n2.4 torque 1200\n9 expect fault none\n9 end\n";
    for inertia in ["10", "94"] {
        let (largest, _) = course("pmasynrm", &["--inertia", inertia], "speed_rpm", slow);
        assert!((450.0..505.0).contains(&largest), "{inertia}: {largest} r/min");
    }
    let free = "0.2 charge\n1.2 enable\n1.6 torque 120 120\n4 expect fault none\n4 end\n";
    let (largest, _) = course("zs9", &[], "speed1_rpm", free);
    assert!((1_450.0..1_535.0).contains(&largest), "{largest} r/min");
}
