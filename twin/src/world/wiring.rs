//! The wiring of each system's board, by the guide.

/// The quantity that an analog pin sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// A motor's phase current: the motor, and the phase.
    Current(usize, usize),
    /// The link's, or the capacitors' voltage.
    Link,
    /// The source's voltage, in front of the contactors.
    Source,
    /// The inductors' current.
    Inductor,
    /// The drivers' ready wire.
    Ready,
}

/// An encoder: its timer, the pins of its tracks and of its index.
#[derive(Clone, Copy, Debug)]
pub struct EncoderWires {
    /// The timer.
    pub timer: &'static str,
    /// Tracks A and B.
    pub tracks: [&'static str; 2],
    /// The index.
    pub index: &'static str,
}

/// The pins, and what is wired to them.
pub struct Wiring {
    /// The gates, with their names.
    pub gates: &'static [(&'static str, &'static str)],
    /// The gates of each leg, as places in [`Self::gates`].
    pub legs: &'static [&'static [usize]],
    /// Precharge relay and main contactor, and their auxiliary contacts.
    pub contactors: [&'static str; 2],
    /// See [`Self::contactors`].
    pub contacts: [&'static str; 2],
    /// The discharge resistor.
    pub discharge: &'static str,
    /// The chopper, if there is one.
    pub chopper: Option<&'static str>,
    /// Analog pins.
    pub sensors: &'static [(&'static str, Sensor)],
    /// The rotors' encoders.
    pub encoders: &'static [EncoderWires],
    /// The drivers' ready wire, as a level.
    pub ready: [&'static str; 2],
    /// The enable input.
    pub enable: &'static str,
    /// The gates' feedback: select, and the signals of the controller that shifts it.
    pub feedback: Option<(&'static str, [(&'static str, &'static str); 2])>,
}

impl Wiring {
    /// The pins of contactors, discharge resistor and chopper.
    pub fn lines(&self) -> impl Iterator<Item = &'static str> {
        self.contactors.into_iter().chain([self.discharge]).chain(self.chopper)
    }
}

/// The transceiver's pins, of either.
pub const BUS: [(&str, &str); 2] = [("PA11", "RX"), ("PA12", "TX")];

/// The PMaSynRM's.
pub const TRACTION: Wiring = Wiring {
    gates: &[("PA8", "uh"), ("PB13", "ul"), ("PA10", "vh"), ("PB15", "vl"), ("PC6", "wh"), ("PC10", "wl")],
    legs: &[&[0, 1], &[2, 3], &[4, 5]],
    contactors: ["PC8", "PC9"],
    contacts: ["PC4", "PC5"],
    discharge: "PC11",
    chopper: Some("PB9"),
    sensors: &[
        ("PA1", Sensor::Current(0, 0)),
        ("PA7", Sensor::Current(0, 0)),
        ("PC1", Sensor::Current(0, 1)),
        ("PB0", Sensor::Current(0, 1)),
        ("PB11", Sensor::Current(0, 2)),
        ("PB14", Sensor::Current(0, 2)),
        ("PC0", Sensor::Link),
    ],
    encoders: &[EncoderWires { timer: "TIM4", tracks: ["PB6", "PB7"], index: "PB3" }],
    ready: ["PB12", "PA6"],
    enable: "PC2",
    feedback: None,
};

/// The ZS9's.
pub const ZS9: Wiring = Wiring {
    gates: &[
        ("PA8", "uh"),
        ("PC6", "vh"),
        ("PB2", "wh"),
        ("PA10", "um"),
        ("PB9", "vm"),
        ("PC8", "wm"),
        ("PA9", "ul"),
        ("PC7", "vl"),
        ("PC2", "wl"),
    ],
    legs: &[&[0, 3, 6], &[1, 4, 7], &[2, 5, 8]],
    contactors: ["PB10", "PB15"],
    contacts: ["PC5", "PC12"],
    discharge: "PC9",
    chopper: None,
    sensors: &[
        ("PA1", Sensor::Current(0, 0)),
        ("PC1", Sensor::Current(0, 1)),
        ("PB11", Sensor::Current(0, 2)),
        ("PB0", Sensor::Current(1, 0)),
        ("PB14", Sensor::Current(1, 1)),
        ("PA7", Sensor::Current(1, 2)),
        ("PC0", Sensor::Link),
        ("PC3", Sensor::Source),
        ("PB1", Sensor::Inductor),
        ("PB13", Sensor::Ready),
    ],
    encoders: &[
        EncoderWires { timer: "TIM4", tracks: ["PB6", "PB7"], index: "PB3" },
        EncoderWires { timer: "TIM3", tracks: ["PB4", "PB5"], index: "PD2" },
    ],
    ready: ["PB12", "PA6"],
    enable: "PC4",
    feedback: Some(("PA15", [("PC10", "SCK"), ("PC11", "MISO")])),
};
