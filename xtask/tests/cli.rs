//! The answers of the program to a command line, as far as that needs no build.

use std::process::{Command, Output};

fn xtask(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_xtask")).args(args).output().expect("the program starts")
}

#[test]
fn bad_usage_exits_with_2_and_says_why() {
    for (args, why) in [
        (&["nonsense"][..], "nonsense"),
        (&[], "Usage"),
        (&["test", "--only", "nonsense"], "nonsense"),
        (&["image", "--nonsense"], "--nonsense"),
        (&["timing", "--json", "--profile"], "cannot be used with"),
        (&["flash", "--board", "any"], "nucleo-g474re"),
    ] {
        let output = xtask(args);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        assert!(said.contains(why), "{args:?}: {said}");
        assert!(output.stdout.is_empty(), "{args:?}");
    }
}

#[test]
fn flash_without_probe_rs_says_how_to_install_it() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
    let output = command.arg("flash").env("PATH", "").output().expect("the program starts");
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr);
    let wanted = "error: probe-rs is missing; install it with: cargo install probe-rs-tools --locked";
    assert_eq!(said.trim_end(), wanted);
}

#[test]
fn help_and_the_list_of_steps_need_nothing() {
    for args in [&["--help"][..], &["test", "--help"]] {
        let output = xtask(args);
        assert_eq!(output.status.code(), Some(0), "{args:?}");
        assert!(String::from_utf8_lossy(&output.stdout).contains("Usage: cargo xtask"), "{args:?}");
    }
    let list = xtask(&["test", "--list"]);
    assert_eq!(list.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&list.stdout).lines().any(|line| line.starts_with("image-check ")));
}
