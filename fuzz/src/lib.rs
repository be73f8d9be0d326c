//! Fuzzing targets, and what must hold in each: one module per target, whose `check` takes any bytes. The ordinary tests include the same modules, with
//! inputs of their own and with every file of `corpus/`.

pub mod bytes;
pub mod corpus;
pub mod drive;
pub mod folder;
pub mod protocol;
pub mod script;
pub mod talk;
pub mod wire;
