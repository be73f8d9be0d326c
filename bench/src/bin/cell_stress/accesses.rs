//! The accesses of the low-priority side, which the PWM interrupt lands in, each a function of its own: `cargo xtask test` finds them
//! by this module and wants every executed instruction of theirs hit. Sizes are those of the drives' cells.

use crate::broken::{Eager, Plain};
use crate::message::Message;
use tractive::cell::{Downlink, Uplink};

pub static DOWNLINK_9: Downlink<Message<9>, 9> = Downlink::new();
pub static DOWNLINK_10: Downlink<Message<10>, 10> = Downlink::new();
pub static UPLINK_27: Uplink<Message<27>, 27> = Uplink::new();
pub static UPLINK_10: Uplink<Message<10>, 10> = Uplink::new();
/// Never written.
pub static EMPTY_27: Uplink<Message<27>, 27> = Uplink::new();
pub static EMPTY_10: Uplink<Message<10>, 10> = Uplink::new();
pub static PLAIN_DOWN: Plain<9> = Plain::new();
pub static PLAIN_UP: Plain<27> = Plain::new();
pub static EAGER: Eager<9> = Eager::new();

#[inline(never)]
pub fn downlink_9_publish(message: &Message<9>) {
    DOWNLINK_9.publish(*message);
}

#[inline(never)]
pub fn downlink_10_publish(message: &Message<10>) {
    DOWNLINK_10.publish(*message);
}

#[inline(never)]
pub fn uplink_27_read(cell: &Uplink<Message<27>, 27>) -> Option<Message<27>> {
    cell.read()
}

#[inline(never)]
pub fn uplink_10_read(cell: &Uplink<Message<10>, 10>) -> Option<Message<10>> {
    cell.read()
}

#[inline(never)]
pub fn plain_publish(message: &Message<9>) {
    PLAIN_DOWN.publish(*message);
}

#[inline(never)]
pub fn plain_read() -> Option<Message<27>> {
    Some(PLAIN_UP.read())
}

#[inline(never)]
pub fn eager_publish(message: &Message<9>) {
    EAGER.publish(*message);
}
