//! The inputs that the image's tasks were given: read out of the record of its accesses, interrupt by interrupt.

use crate::machine::{Access, What};
use crate::time::Time;
use std::collections::VecDeque;

/// The interrupts, as exceptions: PWM (TIM1's update) and control (TIM3).
const PWM: usize = 41;
const CONTROL: usize = 45;
const TIM1_SR: u32 = 0x4001_2C10;
const TIM1_EGR: u32 = 0x4001_2C14;
const TIM4_SR: u32 = 0x4000_0810;
const TIM4_CCR3: u32 = 0x4000_083C;
const ADC1_JDR1: u32 = 0x5000_0080;
const ADC2_JDR1: u32 = 0x5000_0180;
const IDXIF: u32 = 1 << 20;
const UIF: u32 = 1;

/// The values that an interrupt read.
#[derive(Clone, Copy, Debug, Default)]
pub struct Given {
    /// Control's interrupt, not the PWM's.
    pub control: bool,
    /// Of the PWM's: it came for a boundary, by its first look at the timer's flag.
    pub boundary: Option<bool>,
    /// Of control's: it had the PWM's come for a revision, which is not among those that are given.
    pub revised: bool,
    /// The four conversions, in their order.
    pub codes: [u32; 4],
    /// The encoder's index had passed.
    pub index: bool,
    /// The encoder's captured count.
    pub count: u32,
}

/// The interrupts so far that are not complete yet, and the start of the timers.
#[derive(Debug, Default)]
pub struct Stream {
    open: VecDeque<Given>,
    /// The instant at which the timers began to count.
    pub started: Option<Time>,
}

impl Stream {
    /// Takes accesses in; gives the interrupts that are complete, in the order in which they began.
    pub fn take(&mut self, accesses: &[Access]) -> Vec<Given> {
        let mut complete = Vec::new();
        for access in accesses {
            match access.what {
                What::Entry if access.exception == CONTROL => {
                    // A PWM interrupt within control's is over by now, too.
                    complete.extend(self.close());
                    self.open.push_back(Given { control: true, ..Given::default() });
                }
                What::Entry if access.exception == PWM => self.open.push_back(Given::default()),
                What::Entry => {}
                What::Read(address, value) => self.read(access.exception, address, value),
                What::Write(TIM1_EGR, value) if access.exception == 0 && value & 1 != 0 => {
                    self.started = Some(access.at);
                }
                What::Write(..) => {}
            }
        }
        complete
    }

    /// The interrupts that are open, as complete ones.
    fn close(&mut self) -> Vec<Given> {
        let revised = self.open.iter().any(|given| !given.control && given.boundary == Some(false));
        let open = self.open.drain(..).filter(|given| given.control || given.boundary == Some(true));
        open.map(|given| Given { revised: given.control && revised, ..given }).collect()
    }

    fn read(&mut self, exception: usize, address: u32, value: u32) {
        let newest = |control: bool, open: &mut VecDeque<Given>| {
            open.iter().rposition(|given| given.control == control)
        };
        match exception {
            PWM => {
                let Some(index) = newest(false, &mut self.open) else { return };
                match address {
                    TIM1_SR => {
                        self.open[index].boundary.get_or_insert(value & UIF != 0);
                    }
                    _ => code(&mut self.open[index].codes, address.wrapping_sub(ADC2_JDR1), value),
                }
            }
            CONTROL => {
                let Some(index) = newest(true, &mut self.open) else { return };
                let given = &mut self.open[index];
                match address {
                    TIM4_SR => given.index |= value & IDXIF != 0,
                    TIM4_CCR3 => given.count = value,
                    _ => code(&mut given.codes, address.wrapping_sub(ADC1_JDR1), value),
                }
            }
            _ => {}
        }
    }
}

/// A conversion's register among a converter's four.
fn code(codes: &mut [u32; 4], offset: u32, value: u32) {
    if let Some(code) = codes.get_mut(offset as usize / 4) {
        *code = value;
    }
}
