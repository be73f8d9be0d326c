//! The Python package: installed from `python/` into its own environment, and tested against the rig.

use crate::build;
use crate::process::{find, quietly, succeeds};
use crate::workspace::root;
use anyhow::Result;
use std::process::Command;

/// Installs the package with everything that its tests need, and runs them. The inner error is what is missing.
pub fn check() -> Result<Result<bool, String>> {
    let Some(python) = find("python3") else { return Ok(Err("there is no python3".to_owned())) };
    let environment = root().join("target/python");
    let own = environment.join("bin/python3");
    if !own.is_file() && !quietly(Command::new(python).args(["-m", "venv"]).arg(&environment)) {
        let missing = "python3 cannot make an environment with pip (Debian: apt-get install python3-venv)";
        return Ok(Err(missing.to_owned()));
    }
    let mut install = Command::new(&own);
    install.current_dir(root()).args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    if !quietly(install.arg("./python[test]")) {
        return Ok(Err("pip cannot install ./python[test]: it needs a package registry".to_owned()));
    }
    let mut test = Command::new(own);
    test.current_dir(root()).args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider", "python/tests"]);
    Ok(Ok(succeeds(test.env("TRACTIVE_RIG", build::rig()?).env("PYTHONDONTWRITEBYTECODE", "1"))?))
}
