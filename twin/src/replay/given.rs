//! The inputs that the image's tasks were given: read out of the record of its accesses, interrupt by interrupt.

use crate::machine::{Access, What};
use crate::time::Time;
use std::collections::VecDeque;
use tractive_rig::talk::System;

/// The interrupts, as exceptions: the PWM's (TIM1's update), and control's of the PMaSynRM (TIM3) and of the ZS9 (TIM2).
const PWM: usize = 41;
const CONTROL: usize = 45;
const CONTROL_ZS9: usize = 44;
const TIM1_CR1: u32 = 0x4001_2C00;
const TIM1_SR: u32 = 0x4001_2C10;
const TIM1_EGR: u32 = 0x4001_2C14;
/// The encoders' timers: TIM4, and the ZS9's second, TIM3; of each the status and the captured count.
const ENCODERS: [u32; 2] = [0x4000_0800, 0x4000_0400];
const ENCODER_SR: u32 = 0x10;
const ENCODER_CCR3: u32 = 0x3C;
/// The first result of ADC1, ADC2 and ADC3.
const RESULTS: [u32; 3] = [0x5000_0080, 0x5000_0180, 0x5000_0480];
const SPI3_DR: u32 = 0x4000_3C0C;
const IDXIF: u32 = 1 << 20;
const UIF: u32 = 1;
const DIR: u32 = 1 << 4;

/// The values that an interrupt read.
#[derive(Clone, Copy, Debug, Default)]
pub struct Given {
    /// Control's interrupt, not the PWM's.
    pub control: bool,
    /// In the PWM's interrupt: it came for a boundary, by its first look at the timer's flag; on the ZS9 for a peak, by the counter's direction.
    pub boundary: Option<bool>,
    /// In control's interrupt: it made the PWM's come for a revision, which is not among those that are given.
    pub revised: bool,
    /// The conversions of ADC1, ADC2 and ADC3, in their order.
    pub codes: [[u32; 4]; 3],
    /// The encoders.
    pub encoders: [Encoder; 2],
    /// The words of the gates' feedback, and how many have been read.
    pub feedback: ([u32; 2], usize),
}

/// An encoder as an interrupt read it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Encoder {
    /// Its index had passed.
    pub index: bool,
    /// Its captured count.
    pub count: u32,
}

/// The interrupts so far that are not complete yet, and the start of the timers.
#[derive(Debug)]
pub struct Stream {
    system: System,
    open: VecDeque<Given>,
    /// The instant at which the timers began to count.
    pub started: Option<Time>,
}

impl Stream {
    /// Of a system's image.
    pub fn new(system: System) -> Self {
        Self { system, open: VecDeque::new(), started: None }
    }

    fn control(&self) -> usize {
        match self.system {
            System::Pmasynrm => CONTROL,
            System::Zs9 => CONTROL_ZS9,
        }
    }

    /// Takes accesses in; gives the interrupts that are complete, in the order in which they began.
    pub fn take(&mut self, accesses: &[Access]) -> Vec<Given> {
        let mut complete = Vec::new();
        for access in accesses {
            match access.what {
                What::Entry if access.exception == self.control() => {
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
        let control = exception == self.control();
        if !control && exception != PWM {
            return;
        }
        let Some(index) = self.open.iter().rposition(|given| given.control == control) else { return };
        let given = &mut self.open[index];
        match (self.system, address) {
            (System::Pmasynrm, TIM1_SR) if !control => {
                given.boundary.get_or_insert(value & UIF != 0);
            }
            (System::Zs9, TIM1_CR1) if !control => {
                given.boundary.get_or_insert(value & DIR != 0);
            }
            _ => given.take(address, value),
        }
    }
}

impl Given {
    fn take(&mut self, address: u32, value: u32) {
        for (encoder, base) in self.encoders.iter_mut().zip(ENCODERS) {
            match address.wrapping_sub(base) {
                ENCODER_SR => encoder.index |= value & IDXIF != 0,
                ENCODER_CCR3 => encoder.count = value,
                _ => {}
            }
        }
        for (codes, base) in self.codes.iter_mut().zip(RESULTS) {
            if let Some(code) = codes.get_mut(address.wrapping_sub(base) as usize / 4) {
                *code = value;
            }
        }
        let (words, read) = &mut self.feedback;
        if address == SPI3_DR
            && let Some(word) = words.get_mut(*read)
        {
            *word = value;
            *read += 1;
        }
    }
}
