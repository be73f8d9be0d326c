//! Makes the machine's tables, and gives the linker this board's memories and interrupts.

use std::path::Path;
use std::{env, error::Error, fs};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=memory.x");
    let out = env::var("OUT_DIR")?;
    let out = Path::new(&out);
    tractive_tablegen::build("machine", out.join("machine.rs"), "tractive::machine")?;
    fs::copy("memory.x", out.join("memory.x"))?;
    // Interrupts without their own handler end in the default one.
    fs::write(out.join("device.x"), "PROVIDE(TIM1_UP = DefaultHandler);\nPROVIDE(TIM2 = DefaultHandler);\n")?;
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    Ok(())
}
