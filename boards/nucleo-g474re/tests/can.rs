//! The NUCLEO-G474RE's CAN controller against a block of memory: timing, message RAM, filters, both FIFOs, bus-off.

use nucleo_g474re::can::{BIT_RATE, BUS_OFF_MS, BitTiming, CLOCK_HZ, Can, SAMPLE_POINT, TIMING};
use nucleo_g474re::start::{StartError, Timeout, Wait};
use stm32_metapac as pac;
use tractive::protocol::{FROM_DRIVE, Frame, TO_DRIVE};

/// Words of a FIFO's element, and where the FIFOs begin, by the reference manual (RM0440, message RAM).
const ELEMENT: usize = 18;
const RX_FIFO_0: usize = 0xB0 / 4;
const TX_BUFFERS: usize = 0x278 / 4;
/// Words of the message RAM of one controller.
const RAM: usize = 0x350 / 4;

/// Register offsets in words.
const CCCR: usize = 0x18 / 4;
const NBTP: usize = 0x1C / 4;
/// The interrupts that are asked for, and the lines that they have.
const IE: usize = 0x54 / 4;
const ILE: usize = 0x5C / 4;
const PSR: usize = 0x44 / 4;
const RXGFC: usize = 0x80 / 4;
const RXF0S: usize = 0x90 / 4;
const RXF0A: usize = 0x94 / 4;
const TXBC: usize = 0xC0 / 4;
const TXFQS: usize = 0xC4 / 4;
const TXBAR: usize = 0xCC / 4;

struct Bench {
    registers: *mut u32,
    ram: *mut u32,
    rcc: pac::rcc::Rcc,
    can: Can,
}

impl Bench {
    fn new() -> Self {
        let block = |words: usize| Box::leak(vec![0_u32; words].into_boxed_slice()).as_mut_ptr();
        let (registers, ram, rcc) = (block(0x100), block(RAM), block(0x100));
        // SAFETY: the blocks are aligned, as large as the peripherals, never freed, and only this thread has them.
        let (can, memory, rcc) = unsafe {
            (
                pac::can::Fdcan::from_ptr(registers.cast()),
                pac::fdcanram::Fdcanram::from_ptr(ram.cast()),
                pac::rcc::Rcc::from_ptr(rcc.cast()),
            )
        };
        rcc.cr().modify(|w| w.set_hserdy(true));
        Self { registers, ram, rcc, can: Can::new(can, memory) }
    }

    /// The only frame that has come.
    fn receive(&mut self) -> Option<Frame> {
        let mut frames = [Frame::default(); 1];
        (self.can.receive(&mut frames) == 1).then_some(frames[0])
    }

    fn configured() -> Self {
        let bench = Self::new();
        bench.can.configure(&TO_DRIVE, &bench.rcc, &mut Once).unwrap();
        bench
    }

    fn read(&self, word: usize) -> u32 {
        assert!(word < 0x100);
        // SAFETY: within the block of registers.
        unsafe { self.registers.add(word).read_volatile() }
    }

    fn write(&self, word: usize, value: u32) {
        assert!(word < 0x100);
        // SAFETY: as in `read`.
        unsafe { self.registers.add(word).write_volatile(value) }
    }

    fn memory(&self, word: usize) -> u32 {
        assert!(word < RAM);
        // SAFETY: within the message RAM.
        unsafe { self.ram.add(word).read_volatile() }
    }

    fn put(&self, word: usize, value: u32) {
        assert!(word < RAM);
        // SAFETY: as in `memory`.
        unsafe { self.ram.add(word).write_volatile(value) }
    }
}

/// Hardware that answers at once, or never.
struct Once;

impl Wait for Once {
    fn until(&mut self, done: &mut dyn FnMut() -> bool) -> Result<(), Timeout> {
        if done() { Ok(()) } else { Err(Timeout) }
    }

    fn microseconds(&mut self, _us: u32) {}
}

struct Never;

impl Wait for Never {
    fn until(&mut self, _done: &mut dyn FnMut() -> bool) -> Result<(), Timeout> {
        Err(Timeout)
    }

    fn microseconds(&mut self, _us: u32) {}
}

/// A wait that looks at the controller's clock and its CCCR.
struct Watching<'a>(&'a Bench, bool);

impl Wait for Watching<'_> {
    fn until(&mut self, done: &mut dyn FnMut() -> bool) -> Result<(), Timeout> {
        Once.until(done)
    }

    fn microseconds(&mut self, _us: u32) {
        self.1 |= self.0.rcc.apb1enr1().read().fdcanen() && self.0.read(CCCR) == 0;
    }
}

#[test]
fn the_controllers_clock_has_come_before_it_is_written_to() {
    let bench = Bench::new();
    let mut wait = Watching(&bench, false);
    bench.can.configure(&TO_DRIVE, &bench.rcc, &mut wait).unwrap();
    assert!(wait.1);
}

#[test]
fn the_bit_timing_comes_out_exactly() {
    assert_eq!(CLOCK_HZ % (TIMING.prescaler * TIMING.quanta()), 0);
    assert_eq!(CLOCK_HZ / (TIMING.prescaler * TIMING.quanta()), BIT_RATE);
    assert_eq!(1_000 * (1 + TIMING.before_sample), SAMPLE_POINT * TIMING.quanta());
    assert_eq!(TIMING, BitTiming { prescaler: 3, before_sample: 13, after_sample: 2 });
    // Another clock or rate that does not come out is refused, not rounded.
    assert_eq!(BitTiming::exact(25_000_000, 500_000, 875), None);
    assert_eq!(BitTiming::exact(24_000_000, 1_000_000, 875), None);
    assert_eq!(BitTiming::exact(24_000_000, 250_000, 875).map(|timing| timing.prescaler), Some(6));
    assert_eq!(BitTiming::exact(24_000_000, 500_000, 870), None);
    assert_eq!(BitTiming::exact(24_000_000, 0, 875), None);
}

#[test]
fn the_registers_hold_the_timing_and_what_is_let_in() {
    let bench = Bench::configured();
    assert_eq!(bench.read(NBTP), 1 << 25 | 2 << 16 | 12 << 8 | 1, "each is one less than it means");
    assert_eq!(bench.read(CCCR), 0, "classic frames, on the bus, repeated until they are acknowledged");
    let filters = TO_DRIVE.len() as u32 / 2;
    assert_eq!(
        bench.read(RXGFC),
        filters << 16 | 0b10 << 4 | 0b10 << 2 | 0b11,
        "nothing else, nothing remote"
    );
    assert_eq!(bench.read(TXBC), 0, "a FIFO, not a queue by priority");
    assert_eq!(bench.rcc.ccipr().read().fdcansel(), pac::rcc::vals::Fdcansel::HSE);
    assert!(bench.rcc.apb1enr1().read().fdcanen());
}

/// A filter element by the reference manual: whether it stores this identifier in FIFO 0.
fn stores(filter: u32, id: u16) -> bool {
    let (kind, action) = (filter >> 30, filter >> 27 & 7);
    let ids = [(filter >> 16 & 0x7FF) as u16, (filter & 0x7FF) as u16];
    assert_eq!((kind, action), (0b01, 0b001), "dual identifier, stored in FIFO 0");
    ids.contains(&id)
}

#[test]
fn the_protocols_commands_pass_the_filters_and_nothing_else_does() {
    let bench = Bench::configured();
    let filters: Vec<_> = (0..TO_DRIVE.len() / 2).map(|index| bench.memory(index)).collect();
    for id in 0..0x800 {
        let passes = filters.iter().any(|filter| stores(*filter, id));
        assert_eq!(passes, TO_DRIVE.iter().any(|message| message.id == id), "{id:#05X}");
    }
    assert!(FROM_DRIVE.iter().all(|message| filters.iter().all(|filter| !stores(*filter, message.id))));
}

#[test]
fn a_frame_is_read_from_the_element_that_the_controller_names_and_given_back() {
    let mut bench = Bench::configured();
    assert_eq!(bench.receive(), None);
    for index in 0..3_u32 {
        let base = RX_FIFO_0 + index as usize * ELEMENT;
        bench.put(base, 0x101 << 18);
        bench.put(base + 1, 8 << 16);
        bench.put(base + 2, 0x0403_0201 + index);
        bench.put(base + 3, 0x0807_0605);
        bench.write(RXF0S, 1 | index << 8);
        bench.write(RXF0A, 0xFF);
        let frame = bench.receive().unwrap();
        let data = [1 + index as u8, 2, 3, 4, 5, 6, 7, 8];
        assert_eq!(frame, Frame { id: 0x101, length: 8, data });
        assert_eq!(bench.read(RXF0A), index, "acknowledged");
    }
}

#[test]
fn all_that_wait_are_read_in_their_order_and_given_back_together() {
    let mut bench = Bench::configured();
    for index in 0..3_u32 {
        let base = RX_FIFO_0 + index as usize * ELEMENT;
        bench.put(base, (0x100 + index) << 18);
        bench.put(base + 1, 8 << 16);
    }
    for (level, first, room, ids, last) in [
        (3, 1, 8, &[0x101, 0x102, 0x100][..], 0),
        (2, 2, 8, &[0x102, 0x100], 0),
        (3, 0, 2, &[0x100, 0x101], 1),
        (1, 1, 0, &[], 0xFF),
    ] {
        bench.write(RXF0S, level | first << 8);
        bench.write(RXF0A, 0xFF);
        let mut frames = [Frame::default(); 8];
        let taken = bench.can.receive(&mut frames[..room]);
        assert_eq!(frames[..taken].iter().map(|frame| frame.id).collect::<Vec<_>>(), ids);
        assert_eq!(bench.read(RXF0A), last, "acknowledged");
    }
}

#[test]
fn bytes_that_were_not_sent_are_zero_and_codes_above_eight_mean_eight() {
    let mut bench = Bench::configured();
    for code in 0..16_u32 {
        bench.put(RX_FIFO_0, 0x7FF << 18);
        bench.put(RX_FIFO_0 + 1, code << 16);
        bench.put(RX_FIFO_0 + 2, u32::MAX);
        bench.put(RX_FIFO_0 + 3, u32::MAX);
        bench.write(RXF0S, 1);
        let frame = bench.receive().unwrap();
        let length = code.min(8) as u8;
        assert_eq!((frame.id, frame.length), (0x7FF, length));
        assert!(frame.data.iter().enumerate().all(|(k, byte)| (*byte == 0xFF) == (k < usize::from(length))));
    }
}

#[test]
fn a_frame_goes_into_the_free_element_and_is_requested() {
    let mut bench = Bench::configured();
    for index in 0..3_u32 {
        bench.write(TXFQS, index << 16);
        let frame = Frame { id: 0x181, length: 8, data: [8, 7, 6, 5, 4, 3, 2, 1 + index as u8] };
        bench.can.send(&frame);
        let base = TX_BUFFERS + index as usize * ELEMENT;
        let words: Vec<_> = (0..4).map(|word| bench.memory(base + word)).collect();
        assert_eq!(words, [0x181 << 18, 8 << 16, 0x0506_0708, 0x0102_0304 + (index << 24)]);
        assert_eq!(bench.read(TXBAR), 1 << index);
    }
    assert_eq!(bench.can.health().dropped, 0);
}

/// The index has two bits, the FIFO three elements.
#[test]
fn an_index_beyond_the_fifo_is_its_last_element() {
    let mut bench = Bench::configured();
    bench.write(TXFQS, 3 << 16);
    bench.can.send(&Frame { id: 0x181, length: 8, data: [0xAA; 8] });
    assert_eq!(bench.memory(TX_BUFFERS + 2 * ELEMENT), 0x181 << 18);
    assert_eq!(bench.read(TXBAR), 1 << 2);
}

#[test]
fn what_finds_the_fifo_full_is_dropped_and_counted() {
    let mut bench = Bench::configured();
    bench.write(TXFQS, 1 << 21);
    let before: Vec<_> = (0..RAM).map(|word| bench.memory(word)).collect();
    bench.can.send(&Frame { id: 0x181, length: 8, data: [0xAA; 8] });
    assert_eq!((0..RAM).map(|word| bench.memory(word)).collect::<Vec<_>>(), before);
    assert_eq!((bench.read(TXBAR), bench.can.health().dropped), (0, 1));
}

#[test]
fn a_bus_off_is_left_after_a_pause_and_counted_once() {
    let mut bench = Bench::configured();
    bench.can.tend();
    assert_eq!(bench.can.health().bus_offs, 0);
    // The hardware leaves the bus and stops the controller.
    bench.write(PSR, 1 << 7);
    bench.write(CCCR, 1);
    for _ in 0..=BUS_OFF_MS {
        bench.can.tend();
        assert_eq!(bench.read(CCCR) & 1, 1, "not yet");
    }
    bench.can.tend();
    assert_eq!(bench.read(CCCR) & 3, 0, "joins the bus again");
    (0..500).for_each(|_| bench.can.tend());
    bench.write(PSR, 0);
    bench.can.tend();
    assert_eq!(bench.can.health().bus_offs, 1);
    bench.write(PSR, 1 << 7);
    bench.can.tend();
    assert_eq!(bench.can.health().bus_offs, 2);
}

/// However many frames come, and however often the bus is lost: no interrupt is spent on it.
#[test]
fn nothing_on_the_bus_asks_for_an_interrupt() {
    let mut bench = Bench::configured();
    for pass in 0..1_000_u32 {
        bench.write(RXF0S, 3 | (pass % 3) << 8);
        bench.write(PSR, u32::from(pass % 300 > 150) << 7);
        bench.can.receive(&mut [Frame::default(); 8]);
        bench.can.send(&Frame { id: 0x181, length: 8, data: [0; 8] });
        bench.can.tend();
        assert_eq!((bench.read(IE), bench.read(ILE)), (0, 0));
    }
}

#[test]
fn a_controller_that_does_not_answer_is_named() {
    let bench = Bench::new();
    assert_eq!(bench.can.configure(&TO_DRIVE, &bench.rcc, &mut Never), Err(StartError::Can));
}

#[test]
fn the_zs9s_messages_pass_and_no_others() {
    use tractive::protocol::TO_ZS9;
    let bench = Bench::new();
    bench.can.configure(&TO_ZS9, &bench.rcc, &mut Once).unwrap();
    // Five identifiers: three filters, the last of which has one twice.
    let filters: Vec<_> = (0..3).map(|index| bench.memory(index)).collect();
    for id in 0..0x800_u16 {
        let passes =
            filters.iter().any(|filter| [filter >> 16 & 0x7FF, filter & 0x7FF].contains(&u32::from(id)));
        assert_eq!(passes, TO_ZS9.iter().any(|message| message.id == id), "{id:#05X}");
    }
}
