//! The checks of the page in a browser.

use crate::browser::Browser;
use crate::server;
use anyhow::{Context, Result, ensure};
use sha2::{Digest, Sha256};
use std::path::Path;

/// Widths of a window, in CSS pixels.
const WIDTHS: [u32; 3] = [1280, 900, 390];

/// Checks it; the trace is the host's of the same sweep.
pub fn check(page: &Path, trace: &Path, browser: &Path) -> Result<()> {
    let bytes = std::fs::read(trace).with_context(|| trace.display().to_string())?;
    let host: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    let address = server::serve_aside(page)?;
    let mut browser = Browser::start(browser)?;
    browser.resize(1280, 900, false)?;
    browser.go(&address)?;
    browser.until("the page draws", "!!document.body?.dataset.painted")?;
    println!("first paint of the scope after {} ms", browser.evaluate("+document.body.dataset.painted")?);
    browser.until("the drive runs", "document.getElementById('state-name').textContent === 'running'")?;
    moves(&mut browser)?;
    trips(&mut browser)?;
    sweeps(&mut browser, &host)?;
    fits(&mut browser)?;
    contrasts(&mut browser)?;
    runs(&mut browser)?;
    ensure!(browser.errors.is_empty(), "errors on the console: {:?}", browser.errors);
    println!("no error on the console");
    Ok(())
}

/// The torque that is shown, in N·m.
const TORQUE: &str = "+document.querySelector('#numbers b i').textContent.replace('−', '-')";

/// Slider and key move the torque.
fn moves(browser: &mut Browser) -> Result<()> {
    for (what, act, wanted) in [("slider", Some(300), 300), ("key", None, 350), ("slider", Some(-400), -400)]
    {
        match act {
            Some(value) => {
                let set = format!(
                    "(s => {{ s.value = {value}; s.dispatchEvent(new Event('input')); }})(document.getElementById('s-torque'))"
                );
                browser.evaluate(&set)?;
            }
            None => browser.press("ArrowUp")?,
        }
        let near = format!("Math.abs({TORQUE} - {wanted}) < 12");
        browser.until(&format!("torque near {wanted} N·m by {what}"), &near)?;
        println!("torque {} N·m by {what}", browser.evaluate(TORQUE)?);
    }
    Ok(())
}

/// A fault is injected, named, mended, acknowledged, and the drive runs again.
fn trips(browser: &mut Browser) -> Result<()> {
    browser.evaluate("document.querySelector('[data-fault=current-u-railed]').click()")?;
    browser.until(
        "the fault is named",
        "/^overcurrent.*limit \\d/.test(document.getElementById('fault').innerText.replace(/\\s+/g, ' '))",
    )?;
    println!("{}", browser.evaluate("document.getElementById('fault').innerText.replace(/\\s+/g, ' ')")?);
    for button in ["mend", "acknowledge"] {
        browser.evaluate(&format!("document.getElementById('{button}').click()"))?;
    }
    browser.until("it runs again", "document.getElementById('state-name').textContent === 'running'")
}

/// The sweep in the page makes the host's bytes.
fn sweeps(browser: &mut Browser, host: &str) -> Result<()> {
    browser.evaluate("document.getElementById('sweep').click()")?;
    browser.until("the sweep is done", "!!document.getElementById('sum').dataset.sha256")?;
    let found = browser.evaluate("document.getElementById('sum').dataset.sha256")?;
    println!("{}", browser.evaluate("document.getElementById('sum').textContent")?);
    ensure!(found == host, "the sweep's trace.csv: {found} in the page, {host} on the host");
    Ok(())
}

/// Nothing is wider than the window.
fn fits(browser: &mut Browser) -> Result<()> {
    for width in WIDTHS {
        browser.resize(width, 860, false)?;
        std::thread::sleep(std::time::Duration::from_millis(400));
        let wide =
            browser.evaluate("Math.max(document.documentElement.scrollWidth, document.body.scrollWidth)")?;
        ensure!(wide.as_u64() <= Some(width.into()), "at {width} pixels the page is {wide} wide");
    }
    println!("no horizontal scroll bar at {WIDTHS:?} pixels");
    Ok(())
}

/// Text and curves stand out from their ground: 4.5 to 1, WCAG's AA.
fn contrasts(browser: &mut Browser) -> Result<()> {
    const LEAST: &str = "(() => {
        const of = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
        const light = hex => { const [r, g, b] = [1, 3, 5].map(k => parseInt(hex.slice(k, k + 2), 16) / 255).map(c => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
        const ratio = (a, b) => { const [x, y] = [light(of(a)), light(of(b))].sort((p, q) => q - p); return (x + 0.05) / (y + 0.05); };
        const inks = ['text', 'muted', 'accent', 'u', 'v', 'w', 'torque', 'ref', 'speed', 'link', 'flux', 'bad'];
        const pairs = [...inks.map(ink => ['--' + ink, '--card']), ['--text', '--bg'], ['--muted', '--bg'], ['--on-accent', '--accent'], ['--bad', '--bad-bg'], ['--text', '--bad-bg'], ['--text', '--press']];
        return pairs.map(([a, b]) => [ratio(a, b), a + ' on ' + b]).sort((p, q) => p[0] - q[0])[0];
    })()";
    for dark in [false, true] {
        browser.resize(1280, 900, dark)?;
        let least = browser.evaluate(LEAST)?;
        println!("least contrast, {}: {least}", if dark { "dark" } else { "light" });
        ensure!(least[0].as_f64() >= Some(4.5), "contrast {least}: at least 4.5 is wanted");
    }
    Ok(())
}

/// The pace with the scope running: told, not judged.
fn runs(browser: &mut Browser) -> Result<()> {
    browser.evaluate("(r => { r.value = 'Infinity'; r.onchange(); })(document.getElementById('rate'))")?;
    std::thread::sleep(std::time::Duration::from_secs(3));
    let said = browser
        .evaluate("document.getElementById('numbers').lastElementChild.innerText.replace(/\\s+/g, ' ')")?;
    println!("as fast as it goes: {said}");
    Ok(())
}
