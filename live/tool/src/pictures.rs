//! The guide's pictures of the page.

use crate::browser::Browser;
use crate::server;
use anyhow::{Context, Result, ensure};
use base64::Engine;
use std::path::Path;
use std::time::Duration;

/// The largest picture, in bytes.
const LARGEST_BYTES: usize = 240_000;

/// A picture: its name, what the address says behind `#`, the fault that is injected, size, dark or not.
const PICTURES: [(&str, &str, &str, u32, u32, bool); 6] = [
    ("live-light", "held=1350&torque=900&window=0.02&trigger=ia", "", 1280, 1230, false),
    ("live-dark", "held=2600&torque=700&window=0.01&trigger=ia", "", 1280, 940, true),
    ("live-fault", "held=600&torque=-700&window=0.05&trigger=fault", "uh-stuck-off", 1000, 900, false),
    (
        "live-zs9",
        "system=zs9&command2=speed&speed2=600&rotor2=free&load2=30&window=0.02&trigger=ia1",
        "",
        1280,
        1250,
        false,
    ),
    ("live-phone-light", "held=700&torque=600&window=0.05&trigger=ia", "", 390, 844, false),
    ("live-phone-dark", "rotor=free&command=speed&speed=900&inertia=5&window=5", "", 390, 844, true),
];

/// Takes them all.
pub fn take(page: &Path, out: &Path, program: &Path) -> Result<()> {
    let address = server::serve_aside(page)?;
    std::fs::create_dir_all(out)?;
    for (name, words, fault, width, height, dark) in PICTURES {
        let mut browser = Browser::start(program)?;
        browser.resize(width, height, dark)?;
        browser.go(&format!("{address}#{words}"))?;
        browser
            .until("the drive runs", "document.getElementById('state-name')?.textContent === 'running'")?;
        std::thread::sleep(Duration::from_secs(5));
        if !fault.is_empty() {
            browser.evaluate(&format!("document.querySelector('[data-fault={fault}]').click()"))?;
            browser.until("the fault is named", "!document.getElementById('fault').hidden")?;
            std::thread::sleep(Duration::from_secs(2));
        }
        save(&browser.picture()?, &out.join(format!("{name}.png")))?;
    }
    Ok(())
}

/// Saves a picture that the browser has given, in few bytes.
pub fn save(picture: &str, file: &Path) -> Result<()> {
    let png = packed(&base64::prelude::BASE64_STANDARD.decode(picture)?)?;
    ensure!(png.len() <= LARGEST_BYTES, "{}: {} bytes", file.display(), png.len());
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::write(file, &png).with_context(|| file.display().to_string())?;
    println!("{}: {} bytes", file.display(), png.len());
    Ok(())
}

/// The same picture in fewer bytes.
fn packed(picture: &[u8]) -> Result<Vec<u8>> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(picture)).read_info()?;
    let mut pixels = vec![0; reader.output_buffer_size().context("a picture without an end")?];
    let frame = reader.next_frame(&mut pixels)?;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, frame.width, frame.height);
    encoder.set_color(frame.color_type);
    encoder.set_depth(frame.bit_depth);
    encoder.set_deflate_compression(png::DeflateCompression::Level(9));
    encoder.set_filter(png::Filter::NoFilter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels[..frame.buffer_size()])?;
    writer.finish()?;
    Ok(bytes)
}
