//! On the board: runs every block on every input, for a counter outside. On the host: prints their errors.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// A line `name,error` each; the error is the largest of the absolute ones, empty where there is nothing to compare.
#[cfg(not(target_os = "none"))]
fn main() {
    for block in tractive_bench::blocks::ALL {
        let errors = block.exact.map(|exact| {
            (0..tractive_bench::INPUTS).map(tractive_bench::input).fold(0.0, |worst: f64, input| {
                let mut output = [0.0; 2];
                (block.run)(&input, &mut output);
                let pairs = output.into_iter().zip(exact(&input));
                pairs.fold(worst, |worst, (is, should)| worst.max((f64::from(is) - should).abs()))
            })
        });
        println!("{},{}", block.name, errors.map_or_else(String::new, |error| format!("{error:e}")));
    }
}

#[cfg(target_os = "none")]
mod firmware {
    use core::hint::black_box;
    use cortex_m_semihosting::debug;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        for block in tractive_bench::blocks::ALL {
            for n in 0..tractive_bench::INPUTS {
                let (input, mut output) = (tractive_bench::input(n), [0.0; 2]);
                (black_box(block.run))(black_box(&input), black_box(&mut output));
                black_box(output);
            }
        }
        end()
    }

    fn end() -> ! {
        debug::exit(debug::EXIT_SUCCESS);
        loop {
            cortex_m::asm::wfi();
        }
    }

    #[panic_handler]
    fn panic(_info: &core::panic::PanicInfo) -> ! {
        end()
    }
}
