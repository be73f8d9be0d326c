//! The ZS9's registers: the board's own functions against blocks of memory, with a model of three up-down timers behind.

mod bridge;
mod drive;
mod image;
mod model;
mod operator;
mod ports;
mod start;
