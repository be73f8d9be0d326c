//! The reader of scripts by itself: the rig as a whole would take minutes to build.

#[path = "../../rig/src/talk/script.rs"]
pub mod script;
#[path = "../../rig/src/talk/system.rs"]
mod system;

pub use system::System;
