//! A drive on the host: the firmware's own tasks, called in the order in which their interrupts would come.

use super::Progress;
use crate::bench::Simulated;
use anyhow::Result;
use tractive::time::Instant;

/// The two interrupts of a drive, with the cells between them.
pub trait Interrupts {
    /// The bench that they run on.
    type Bench: Simulated;

    /// The instants of the next control and PWM interrupts.
    fn next_calls(&self) -> [Instant; 2];
    /// The PWM interrupt.
    fn pwm(&mut self, bench: &mut Self::Bench) -> Result<()>;
    /// The control interrupt, and the idle loop after its end.
    fn control(&mut self, bench: &mut Self::Bench) -> Result<()>;

    /// The instant of the next interrupt, and `true` if it is the PWM's: at equal instants the PWM's comes first, with its higher priority.
    fn next(&self, bench: &Self::Bench) -> (Instant, bool) {
        let [control_at, pwm_at] = self.next_calls();
        let is_pwm = control_at.reached(pwm_at) || !bench.has_control(control_at);
        (if is_pwm { pwm_at } else { control_at }, is_pwm)
    }

    /// The instant of the next interrupt.
    fn next_call(&self, bench: &Self::Bench) -> Instant {
        self.next(bench).0
    }

    /// The next interrupt.
    fn call(&mut self, bench: &mut Self::Bench) -> Result<()> {
        let (_, is_pwm) = self.next(bench);
        if is_pwm { self.pwm(bench) } else { self.control(bench) }
    }

    /// Runs until the bench's recording is complete, or nobody wants to see more of it.
    fn drive(
        &mut self,
        bench: &mut Self::Bench,
        mut goes_on: impl FnMut(&Self::Bench) -> bool,
    ) -> Result<()> {
        while !bench.is_done() {
            self.call(bench)?;
            if !goes_on(bench) {
                break;
            }
        }
        Ok(())
    }
}

/// Runs until the recording is complete; `record` reads the flight recorder.
pub(crate) fn on_host<T: Interrupts>(
    name: &str,
    mut bench: T::Bench,
    mut tasks: T,
    record: impl FnMut(usize) -> Option<<T::Bench as Simulated>::Record>,
) -> Result<<T::Bench as Simulated>::Recording> {
    let mut progress = Progress::new(name);
    tasks.drive(&mut bench, |bench| {
        progress.show(bench.progress());
        true
    })?;
    Ok(bench.into_recording((0..).map_while(record).collect()))
}
