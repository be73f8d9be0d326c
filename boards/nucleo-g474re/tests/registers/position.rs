//! The position sensors that take the encoder's place: what they configure, and the angles that they read.

use crate::bench::Bench;
use crate::bench::write_input;
use crate::devices;
use nucleo_g474re::Control;
use nucleo_g474re::built_in::traction::BUILT_IN;
use nucleo_g474re::position::{
    Absolute, Biss, CHANNELS, Encoder, FRAME, Position, PositionState, Resolver, TIM4_BY_TIM3, checksum,
    decoded,
};
use nucleo_g474re::power_stage::{AdcCode, POWER_STAGE, PowerStage};
use nucleo_g474re::registers::Registers;
use std::sync::atomic::Ordering;
use stm32_metapac::adc::Adc;
use stm32_metapac::bdma::vals::Dir;
use stm32_metapac::metadata::METADATA;
use stm32_metapac::spi::vals::{Br, Cpha, Cpol};
use stm32_metapac::timer::vals::{Ocm, Sms};
use tractive::frames::Angle;
use tractive::ports::ControlPort;
use tractive::time::Instant;

type Ssi = Absolute<13, true>;
/// Three turns of the machine for one of the resolver, 1 V at the converter, 10 µs of lag.
type Wound = Resolver<3, 1_241, 850>;

fn prepared<P: Position>() -> (Bench, P) {
    let mut bench = Bench::started(devices());
    let registers = bench.registers;
    P::prepare(&registers, &POWER_STAGE, &mut bench).unwrap();
    P::follow(&registers, &mut bench);
    (bench, P::of(&registers, &POWER_STAGE, &BUILT_IN.ratings))
}

/// SPI1 has received these words, the same each.
fn receive(registers: &Registers, word: u16, complete: bool) {
    registers.spi1.dr16().write_value(word);
    registers.spi1.sr().write(|w| w.set_rxne(complete));
}

#[test]
fn an_absolute_encoders_clock_rests_high_and_its_bits_are_taken_as_it_falls() {
    let (bench, _) = prepared::<Ssi>();
    let registers = bench.registers;
    assert!(registers.rcc.apb2enr().read().spi1en());
    let control = registers.spi1.cr1().read();
    assert_eq!((control.cpol(), control.cpha()), (Cpol::IDLE_HIGH, Cpha::FIRST_EDGE));
    // 170 MHz / 128: 32 clocks are 24 µs.
    assert_eq!(control.br(), Br::DIV128);
    assert!(control.spe());
}

#[test]
fn an_absolute_angle_is_that_of_the_frame_before() {
    let (bench, mut sensor) = prepared::<Ssi>();
    let registers = bench.registers;
    assert_eq!(sensor.angle(), None, "nothing was asked for");
    let word = 0b1001_0110_0110_1000;
    receive(&registers, word, true);
    let position = decoded(u32::from(word) << 16 | u32::from(word), 13, true).unwrap();
    let turns = (f64::from(position) + 0.5) / 8_192.0 * 4.0;
    let angle = sensor.angle().unwrap() - POWER_STAGE.encoder_zero;
    assert!((f64::from(angle.0) / 4_294_967_296.0 - turns.fract()).abs() < 1e-9);
    assert_eq!(registers.spi1.dr16().read(), 0, "the next frame is under way");
    for (word, complete) in [(word, false), (0, true), (u16::MAX, true)] {
        receive(&registers, word, complete);
        assert_eq!(sensor.angle(), None, "{word:#x}");
        receive(&registers, 0b1001_0110_0110_1000, true);
        assert!(sensor.angle().is_some());
    }
}

/// The DMA has written this frame, or all but its last word.
fn write_frame(registers: &Registers, frame: u64, complete: bool) {
    for (word, shift) in FRAME.iter().zip([48, 32, 16, 0]) {
        word.store((frame >> shift) as u16, Ordering::Relaxed);
    }
    registers.dma1.ch(CHANNELS[0].0).ndtr().write(|w| w.set_ndt(u16::from(!complete)));
}

#[test]
fn a_biss_frame_is_fetched_by_dma_and_checked_by_its_sum() {
    let (bench, mut sensor) = prepared::<Biss<18, 4>>();
    let registers = bench.registers;
    assert_eq!(<Biss<18, 4>>::PINS, Ssi::PINS);
    assert!(registers.rcc.ahb1enr().read().dma1en() && registers.rcc.ahb1enr().read().dmamux1en());
    let (control, words) = (registers.spi1.cr1().read(), registers.spi1.cr2().read());
    assert_eq!((control.cpol(), control.cpha()), (Cpol::IDLE_HIGH, Cpha::SECOND_EDGE));
    // 170 MHz / 64: 64 clocks are 24 µs.
    assert_eq!(control.br(), Br::DIV64);
    assert!(words.rxdmaen() && words.txdmaen());
    assert_eq!(sensor.angle(), None, "nothing was asked for");
    let (receives, sends) = (registers.dma1.ch(CHANNELS[0].0), registers.dma1.ch(CHANNELS[1].0));
    for (channel, direction, walks) in
        [(receives, Dir::FROM_PERIPHERAL, true), (sends, Dir::FROM_MEMORY, false)]
    {
        let control = channel.cr().read();
        assert!(control.en(), "the next frame is under way");
        assert_eq!((control.dir(), control.minc(), channel.ndtr().read().ndt()), (direction, walks, 4));
        assert_eq!(channel.par().read(), registers.spi1.dr16().as_ptr() as usize as u32);
    }
    // Nine turns, and a sixteenth: of four pole pairs a quarter.
    let data = (9 << 18 | 1 << 14) << 2 | 0b11_u64;
    let body = 1 << 32 | data << 7 | u64::from(!checksum(data) & 0x3F) << 1;
    let frame = 0b11 << 62 | body << 20;
    for (frame, complete, known) in [
        (frame, true, true),
        (frame, true, true),
        (frame ^ 1 << 40, true, true),
        (frame, false, true),
        (frame ^ 1 << 22, true, false),
        (0, true, false),
        (u64::MAX, true, false),
        (frame, true, true),
        (frame, false, false),
    ] {
        write_frame(&registers, frame, complete);
        let angle = sensor.angle();
        assert_eq!(angle.is_some(), known, "{frame:#x}, {complete}");
        let turned = angle.map(|angle| angle - POWER_STAGE.encoder_zero);
        assert!(turned.is_none_or(|turned| turned == Angle((1 << 30) + 4 * (1 << 13))), "{turned:?}");
    }
}

#[test]
fn the_chips_multiplexer_leads_spi1s_requests_to_the_channels() {
    let spi1 = METADATA.peripherals.iter().find(|peripheral| peripheral.name == "SPI1").unwrap();
    for ((channel, request), signal) in CHANNELS.into_iter().zip(["RX", "TX"]) {
        let found = spi1.dma_channels.iter().find(|found| found.signal == signal).unwrap();
        assert_eq!((found.dmamux, found.request), (Some("DMAMUX1"), Some(u32::from(request))));
        // Channel 1 of DMA1 is the multiplexer's channel 0, and the block's number 0.
        let own =
            METADATA.dma_channels.iter().find(|own| own.name == format!("DMA1_CH{}", channel + 1)).unwrap();
        assert_eq!((own.channel as usize, own.dmamux_channel), (channel, Some(own.channel)));
    }
}

/// From 0 to one less than there are in a turn, at every edge of both tracks; the index sets it to 0.
#[test]
fn an_encoders_timer_counts_a_turn() {
    let timer = Bench::started(devices()).registers.tim4;
    assert_eq!(u32::from(timer.arr().read().arr()) + 1, POWER_STAGE.encoder_counts);
    assert_eq!(timer.smcr().read().sms(), Sms::ENCODER_MODE_3);
    assert!(timer.ecr().read().ie() && timer.cr1().read().cen());
    for encoder_index_ab in [0b00, 0b10, 0b11] {
        let stage = PowerStage { encoder_index_ab, ..POWER_STAGE };
        Encoder::configure(timer, &stage, TIM4_BY_TIM3);
        assert!(timer.ecr().read().ie());
        assert_eq!(timer.ecr().read().ipos(), encoder_index_ab);
    }
}

#[test]
fn a_resolver_is_excited_at_half_the_control_rate_in_step_with_its_samples() {
    let (bench, _) = prepared::<Wound>();
    let Registers { tim3, adc3, adc5, .. } = bench.registers;
    assert_eq!(tim3.ccmr_output(0).read().ocm(1), Ocm::TOGGLE);
    assert!(tim3.ccer().read().cce(1) && !tim3.ccer().read().cce(0));
    assert_eq!(tim3.ccr(1).read().ccr(), 850);
    for (adc, channel) in [(adc3, 1), (adc5, 2)] {
        let sequence = adc.jsqr().read();
        assert_eq!((sequence.jl(), sequence.jsq(0), sequence.jextsel()), (0, channel, 12));
        assert!(adc.cr().read().aden());
    }
}

/// A period: the windings by their share of the amplitude, the excitation's sign, and the converters' offset.
fn wind(bench: &mut Bench, [sine, cosine]: [f64; 2], positive: bool) {
    let Registers { adc3, adc5, gpiob, .. } = bench.registers;
    write_input(gpiob, u32::from(positive) << 5);
    let sign = if positive { 1.0 } else { -1.0 };
    let mut convert = |adc: Adc, channel: usize, share: f64| {
        bench.codes[channel] = (2_100.0 + sign * 1_241.0 * share).round() as u16;
        bench.finish_sequence(adc);
    };
    convert(adc3, 1, sine);
    convert(adc5, 2, cosine);
}

#[test]
fn a_resolver_tells_every_angle_whatever_the_converters_offset() {
    let (mut bench, mut sensor) = prepared::<Wound>();
    for (period, degrees) in (0..3_600).step_by(7).enumerate() {
        let (sine, cosine) = (0.1 * f64::from(degrees)).to_radians().sin_cos();
        wind(&mut bench, [sine, cosine], period % 2 == 0);
        sensor.angle();
        wind(&mut bench, [sine, cosine], period % 2 == 1);
        let told = sensor.angle().unwrap() - POWER_STAGE.encoder_zero;
        let wanted = Angle((0.3 * f64::from(degrees) / 360.0 * 4_294_967_296.0) as u64 as u32);
        let off = f64::from((told - wanted).signed()) / 4_294_967_296.0 * 360.0;
        assert!(off.abs() < 0.2, "{off}° at {degrees}");
    }
}

/// An open wire stays constant: without a check of the range, the other winding alone would be an angle.
#[test]
fn a_wire_that_is_pulled_to_an_end_of_the_range_is_no_winding() {
    let (mut bench, mut sensor) = prepared::<Wound>();
    for (pulled, known) in [(3_000, true), (4_090, false), (3_000, true), (5, false)] {
        let mut told = None;
        for positive in [true, false, true] {
            wind(&mut bench, [1.0, 0.0], positive);
            bench.codes[2] = pulled;
            bench.finish_sequence(bench.registers.adc5);
            told = sensor.angle();
        }
        assert_eq!(told.is_some(), known, "{pulled}");
    }
}

#[test]
fn a_resolver_without_excitation_or_with_an_open_wire_has_no_angle() {
    let (mut bench, mut sensor) = prepared::<Wound>();
    let mut told = |windings: [f64; 2]| {
        for positive in [true, false, true] {
            wind(&mut bench, windings, positive);
            sensor.angle();
        }
        wind(&mut bench, windings, false);
        sensor.angle()
    };
    assert!(told([0.6, 0.8]).is_some());
    for (windings, what) in [
        ([0.0, 0.0], "no excitation"),
        ([0.6, 0.0], "a shorted winding"),
        ([0.9, 1.1], "too much"),
        ([0.6, 1.6], "pulled to the converter's end"),
        ([1.65, 0.6], "pulled to the converter's end"),
    ] {
        assert_eq!(told(windings), None, "{what}");
        assert!(told([0.6, 0.8]).is_some(), "again, after {what}");
    }
}

/// The drive is told no angle, which it names as `sensor_lost`, and the operator that the angle is not known.
#[test]
fn control_is_told_of_a_lost_excitation() {
    let (mut bench, sensor) = prepared::<Wound>();
    let state = PositionState::new();
    let registers = bench.registers;
    let mut control = Control::new(registers, [AdcCode(2_048); 3], sensor, &state);
    for (windings, known) in [([0.6, 0.8], true), ([0.0, 0.0], false), ([0.6, 0.8], true)] {
        for positive in [true, false, true] {
            wind(&mut bench, windings, positive);
            bench.finish_sequence(registers.adc1);
            let angle = control.sample(Instant(0)).angle;
            assert!(positive || (angle.is_some(), state.is_known()) == (known, known), "{windings:?}");
            assert!(control.turned().is_none() && !state.is_counted(), "it counts nothing");
        }
    }
}
