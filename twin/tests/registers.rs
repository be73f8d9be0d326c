//! Names and reset values of every register that the twin models, beside those of the manufacturer's description (the SVD file, as the crate
//! `stm32g4` has it).

use std::collections::BTreeSet;
use std::path::Path;
use stm32g4::Resettable;
use stm32g4::stm32g474 as svd;
use tractive_rig::talk::System;
use tractive_twin::chip::Chip;
use tractive_twin::finding::Findings;
use tractive_twin::map::{Map, peripherals};
use tractive_twin::run::{Settings, machine};

/// A register of the description: its offset, its name, its value after a reset.
type Published = (u32, &'static str, u32);

/// The registers of a peripheral of the description, by the modules that hold them.
macro_rules! published {
    ($peripheral:ident: $($offset:literal $module:ident $register:ident),+ $(,)?) => {
        &[$(($offset, stringify!($module), svd::$peripheral::$module::$register::RESET_VALUE as u32)),+]
    };
}

const RCC: &[Published] = published!(rcc:
    0x00 cr CRrs, 0x08 cfgr CFGRrs, 0x0C pllcfgr PLLCFGRrs, 0x48 ahb1enr AHB1ENRrs, 0x4C ahb2enr AHB2ENRrs, 0x50 ahb3enr AHB3ENRrs,
    0x58 apb1enr1 APB1ENR1rs, 0x5C apb1enr2 APB1ENR2rs, 0x60 apb2enr APB2ENRrs, 0x88 ccipr CCIPRrs, 0x94 csr CSRrs);
const PWR: &[Published] = published!(pwr: 0x04 cr2 CR2rs, 0x08 cr3 CR3rs, 0x80 cr5 CR5rs);
const FLASH: &[Published] = published!(flash: 0x00 acr ACRrs);
const SYSCFG: &[Published] = published!(syscfg: 0x1C cfgr2 CFGR2rs, 0x20 swpr SWPRrs);
const DBGMCU: &[Published] = published!(dbgmcu: 0x04 cr CRrs, 0x08 apb1l_fz APB1L_FZrs, 0x0C apb1h_fz APB1H_FZrs, 0x10 apb2_fz APB2_FZrs);
const IWDG: &[Published] = published!(iwdg: 0x04 pr PRrs, 0x08 rlr RLRrs, 0x0C sr SRrs);
const SPI: &[Published] = published!(spi1: 0x00 cr1 CR1rs, 0x04 cr2 CR2rs, 0x08 sr SRrs, 0x0C dr DRrs);
const COMP: &[Published] = published!(comp: 0x00 ccsr CCSRrs);
const DAC: &[Published] =
    published!(dac1: 0x00 cr CRrs, 0x08 dhr12r DHR12Rrs, 0x14 dhr12r DHR12Rrs, 0x3C mcr MCRrs);
const COMMON: &[Published] = published!(adc12_common: 0x08 ccr CCRrs);
const ADC: &[Published] = published!(adc1:
    0x00 isr ISRrs, 0x08 cr CRrs, 0x0C cfgr CFGRrs, 0x14 smpr1 SMPR1rs, 0x18 smpr2 SMPR2rs, 0x4C jsqr JSQRrs,
    0x80 jdr JDRrs, 0x84 jdr JDRrs, 0x88 jdr JDRrs, 0x8C jdr JDRrs);
const FDCAN: &[Published] = published!(fdcan:
    0x18 cccr CCCRrs, 0x1C nbtp NBTPrs, 0x44 psr PSRrs, 0x80 rxgfc RXGFCrs, 0x90 rxf0s RXF0Srs, 0xC0 txbc TXBCrs, 0xC4 txfqs TXFQSrs,
    0x100 ckdiv CKDIVrs);
const PORT: &[Published] = published!(gpioa:
    0x04 otyper OTYPERrs, 0x10 idr IDRrs, 0x14 odr ODRrs, 0x1C lckr LCKRrs, 0x20 afrl AFRLrs, 0x24 afrh AFRHrs);
const PORT_A: &[Published] =
    published!(gpioa: 0x00 moder MODERrs, 0x08 ospeedr OSPEEDRrs, 0x0C pupdr PUPDRrs);
const PORT_B: &[Published] =
    published!(gpiob: 0x00 moder MODERrs, 0x08 ospeedr OSPEEDRrs, 0x0C pupdr PUPDRrs);
const PORT_C: &[Published] =
    published!(gpioc: 0x00 moder MODERrs, 0x08 ospeedr OSPEEDRrs, 0x0C pupdr PUPDRrs);
const TIMER: &[Published] = published!(tim1:
    0x00 cr1 CR1rs, 0x04 cr2 CR2rs, 0x08 smcr SMCRrs, 0x0C dier DIERrs, 0x10 sr SRrs, 0x18 ccmr1_output CCMR1_OUTPUTrs,
    0x1C ccmr2_output CCMR2_OUTPUTrs, 0x20 ccer CCERrs, 0x24 cnt CNTrs, 0x28 psc PSCrs, 0x30 rcr RCRrs, 0x34 ccr CCRrs, 0x38 ccr CCRrs,
    0x3C ccr CCRrs, 0x40 ccr CCRrs, 0x44 bdtr BDTRrs, 0x48 ccr5 CCR5rs, 0x4C ccr5 CCR5rs, 0x58 ecr ECRrs);
const WIDE: &[Published] = published!(tim2: 0x2C arr ARRrs, 0x60 af1 AF1rs);
const ADVANCED: &[Published] = published!(tim1: 0x2C arr ARRrs, 0x60 af1 AF1rs);
const GENERAL: &[Published] = published!(tim3: 0x2C arr ARRrs, 0x60 af1 AF1rs);
const SMALL: &[Published] = published!(tim16: 0x2C arr ARRrs, 0x60 af1 AF1rs);

/// The description of a peripheral, in parts.
fn described(peripheral: &str) -> [&'static [Published]; 2] {
    match peripheral {
        "RCC" => [RCC, &[]],
        "PWR" => [PWR, &[]],
        "FLASH" => [FLASH, &[]],
        "SYSCFG" => [SYSCFG, &[]],
        "DBGMCU" => [DBGMCU, &[]],
        "IWDG" => [IWDG, &[]],
        "SPI3" => [SPI, &[]],
        "DAC3" | "DAC4" => [DAC, &[]],
        "ADC12_COMMON" | "ADC345_COMMON" => [COMMON, &[]],
        "ADC1" | "ADC2" | "ADC3" => [ADC, &[]],
        "FDCAN1" => [FDCAN, &[]],
        "GPIOA" => [PORT, PORT_A],
        "GPIOB" => [PORT, PORT_B],
        "TIM2" => [TIMER, WIDE],
        "TIM1" | "TIM8" | "TIM20" => [TIMER, ADVANCED],
        "TIM3" | "TIM4" => [TIMER, GENERAL],
        "TIM17" => [TIMER, SMALL],
        name if name.starts_with("COMP") => [COMP, &[]],
        name if name.starts_with("GPIO") => [PORT, PORT_C],
        _ => [&[], &[]],
    }
}

/// Registers whose value after a reset differs between the reference manual and the description: the manual's.
const OTHERWISE: [(&str, u32, u32); 10] = [
    // RM0440, 7.4.1: the internal oscillator is on and ready. The description has a relative's trimming there.
    ("RCC", 0x00, 0x0500),
    // RM0440, 3.7.1: the debugger's bit, too.
    ("FLASH", 0x00, 0x0004_0600),
    // RM0440, TIMx_AF1: BKINE is set.
    ("TIM1", 0x60, 1),
    ("TIM8", 0x60, 1),
    ("TIM17", 0x60, 1),
    ("TIM20", 0x60, 1),
    // Of 16 bits.
    ("TIM3", 0x2C, 0xFFFF),
    ("TIM4", 0x2C, 0xFFFF),
    // The levels at the pins: the debug port's have pull-ups.
    ("GPIOA", 0x10, 0xA000),
    ("GPIOB", 0x10, 0x0010),
];

/// The letters of a name: the descriptions number their registers differently.
fn letters(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphabetic).collect::<String>().to_ascii_lowercase()
}

#[test]
fn every_modelled_register_is_as_published_after_a_reset() {
    let settings = Settings::new(Path::new(""), System::Pmasynrm, "1 end".to_owned());
    let mut world = machine(&settings).unwrap().world;
    let map = Map::new();
    let mut wrong = Vec::new();
    let mut seen = BTreeSet::new();
    let (mut fresh, mut clocked) = (Chip::new(), Chip::new());
    for enable in [0x48, 0x4C, 0x50, 0x58, 0x5C, 0x60] {
        let all = map.at(0x4002_1000 + enable).unwrap().mask;
        clocked.write(0x4002_1000 + enable, 4, all, 0, &mut Findings::default());
    }
    for (address, register) in map.registers() {
        let peripheral = peripherals()[register.peripheral].name;
        // The message RAM holds anything after a reset.
        if peripheral == "FDCANRAM1" || !register.readable {
            continue;
        }
        let chip = if peripheral == "RCC" { &mut fresh } else { &mut clocked };
        let mut findings = Findings::default();
        let value = chip.read(address, 4, 0, &mut world, &mut findings);
        if findings.all.iter().any(|finding| finding.text.ends_with("does not model")) {
            continue;
        }
        assert!(findings.all.is_empty(), "{:?}", findings.all);
        let of = described(peripheral).into_iter().flatten();
        let Some((_, name, published)) = of.copied().find(|(offset, ..)| *offset == register.offset) else {
            wrong.push(format!(
                "{peripheral}.{}, {:#x}: not in the description",
                register.name, register.offset
            ));
            continue;
        };
        let known = OTHERWISE.iter().find(|(at, offset, _)| *at == peripheral && *offset == register.offset);
        let expected = known.map_or(published, |(.., value)| *value);
        if known.is_some_and(|_| expected == published) {
            wrong.push(format!("{peripheral}.{name}: no longer otherwise"));
        }
        if value != expected {
            wrong.push(format!("{peripheral}.{name} is {value:#x} after a reset, published {published:#x}"));
        }
        let (own, other) = (letters(&register.name), letters(name));
        if !(own.starts_with(&other) || other.starts_with(&own) || other.ends_with(&own)) {
            wrong
                .push(format!("{peripheral}, {:#x} is {}, published {name}", register.offset, register.name));
        }
        seen.insert((peripheral, register.offset));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    println!("{} registers are as published", seen.len());
    assert!(seen.len() > 250, "{}", seen.len());
}
