//! The checks of the page in a browser.

use crate::axe::Axe;
use crate::browser::Browser;
use crate::server;
use anyhow::{Context, Result, ensure};
use base64::Engine;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Widths of a window, in CSS pixels.
const WIDTHS: [u32; 3] = [1280, 900, 390];

/// All scenarios of either system in the page: their traces are the host's.
const SAME: [&[&str]; 2] = [
    &[
        "sweep",
        "sweep --to 2000 --real",
        "load-steps",
        "full-step",
        "reversal",
        "restart",
        "link-steps",
        "chopper",
        "precharge",
        "acknowledge",
    ],
    &["zs9-load-step", "zs9-reverse", "zs9-cycle"],
];

/// Checks it with both systems; the rig makes the host's traces of the same scenarios.
pub fn check(page: &Path, rig: &Path, browser: &mut Browser, axe: &Axe) -> Result<()> {
    let address = server::serve_aside(page)?;
    open(browser, &address)?;
    println!("first paint after {} ms", browser.evaluate(FIRST_PAINT)?);
    println!("first paint of the scope after {} ms", browser.evaluate("+document.body.dataset.painted")?);
    moves(browser, &[("s-torque", "", [300, 350, -400])])?;
    browser.until("the spectrum has its bound", "+document.getElementById('spectrum').dataset.bound > 3")?;
    trips(browser, "current-u-railed")?;
    saves(browser)?;
    runs(browser)?;
    equal_the_host(browser, rig, SAME[0])?;
    ends(browser, axe, "live, pmasynrm")?;
    open(browser, &format!("{address}#system=zs9&command2=speed"))?;
    moves(browser, &[("s-torque1", "1", [70, 75, -40]), ("s-speed2", "2", [800, 0, 0])])?;
    bound_is_met(browser)?;
    trips(browser, "angle-2-lost")?;
    saves(browser)?;
    runs(browser)?;
    equal_the_host(browser, rig, SAME[1])?;
    ends(browser, axe, "live, zs9")?;
    open(browser, &format!("{address}#machine=pmsm-48v-1kw"))?;
    ensure!(browser.errors.is_empty(), "errors on the console: {:?}", browser.errors);
    Ok(())
}

/// The spectrum of the ZS9's current has its bound, and the largest of the pulses' harmonics is as large as measured: the bound is neither
/// another motor's nor of other pulses.
fn bound_is_met(browser: &mut Browser) -> Result<()> {
    const MET: &str =
        "(of => of.bound > 1 && Math.abs(of.over - 1) < 0.05)(document.getElementById('spectrum').dataset)";
    browser.until("the spectrum has its bound", MET)?;
    const SAID: &str = "(of => `${of.bound} lines, the largest measured ${(100 * of.over).toFixed(1)} % of its bound`)(document.getElementById('spectrum').dataset)";
    println!("the pulses' bound: {}", browser.evaluate(SAID)?);
    Ok(())
}

/// Time of the browser's own first paint, in ms.
const FIRST_PAINT: &str =
    "Math.round(performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? -1)";

/// Opens the page, and waits until its drive runs.
fn open(browser: &mut Browser, address: &str) -> Result<()> {
    browser.resize(1280, 900, false)?;
    browser.go(address)?;
    browser.until("the page draws", "!!document.body?.dataset.painted")?;
    browser.until("the drive runs", RUNNING)
}

/// The drive runs.
const RUNNING: &str = "document.getElementById('state-name').textContent === 'running'";

/// The looks of the page, and that nothing went wrong.
fn ends(browser: &mut Browser, axe: &Axe, name: &str) -> Result<()> {
    fits(browser)?;
    contrasts(browser)?;
    for (width, dark) in [(1280, false), (390, true)] {
        browser.resize(width, 900, dark)?;
        axe.check(browser, &format!("{name}, {width} pixels"))?;
    }
    ensure!(browser.errors.is_empty(), "errors on the console: {:?}", browser.errors);
    println!("no error on the console");
    Ok(())
}

/// Checks the page of a drive elsewhere, which `rig live` serves: it looks, and commands only where that is permitted and switched on.
pub fn check_remote(rig: &Path, on: &str, browser: &mut Browser, axe: &Axe) -> Result<()> {
    for (system, on, permitted) in [("pmasynrm", "host", false), ("zs9", on, true)] {
        let mut words = vec!["live", "--system", system, "--on", on, "--no-open", "--seconds", "1200"];
        words.extend(permitted.then_some("--commands"));
        let child = Command::new(rig).args(words).stdout(Stdio::piped()).spawn()?;
        let mut served = Served(child);
        let mut line = String::new();
        BufReader::new(served.0.stdout.take().context("no output")?).read_line(&mut line)?;
        let address = line.split_whitespace().next().context("rig live tells no address")?.to_owned();
        browser.resize(1280, 900, false)?;
        browser.go(&address)?;
        browser.until("the page draws", "!!document.body?.dataset.painted")?;
        let state = |name: &str| format!("document.getElementById('state-name').textContent === '{name}'");
        browser.until("the drive is ready", &state("ready"))?;
        let allowed = browser.evaluate("!document.getElementById('arm').disabled")?;
        ensure!(allowed == permitted, "{system}: commands allowed {allowed}, permitted {permitted}");
        browser.evaluate("document.getElementById('on').click()")?;
        std::thread::sleep(Duration::from_secs(1));
        ensure!(browser.evaluate(&state("ready"))? == true, "{system}: it is commanded unasked");
        if permitted {
            browser.evaluate("document.getElementById('on').click()")?;
            browser.evaluate("document.getElementById('arm').click()")?;
            set(browser, "s-torque1", 20)?;
            set(browser, "s-torque2", 10)?;
            browser.evaluate("document.getElementById('on').click()")?;
            browser.until("the drive runs", RUNNING)?;
            browser.until("it turns", "+document.querySelectorAll('#numbers b i')[1].textContent > 50")?;
        } else {
            const ARM: &str = "fetch('/arm', { method: 'POST', headers: { 'X-Tractive': 'arm' }, body: 'on' }).then(answer => answer.status)";
            let answer = browser.evaluate(ARM)?;
            ensure!(answer == 409, "commands that are not permitted: {answer}");
            // The browser itself calls that answer an error.
            browser.errors.clear();
        }
        fits(browser)?;
        axe.check(browser, &format!("rig live, {system}"))?;
        ensure!(browser.errors.is_empty(), "errors on the console: {:?}", browser.errors);
        println!("rig live, {system} on {on}: it looks; commands permitted {permitted}");
    }
    Ok(())
}

/// A program that ends with this.
struct Served(Child);

impl Drop for Served {
    fn drop(&mut self) {
        // It may be gone already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Moves a slider.
fn set(browser: &mut Browser, slider: &str, value: i32) -> Result<()> {
    let set = format!(
        "(s => {{ s.value = {value}; s.dispatchEvent(new Event('input')); }})(document.getElementById('{slider}'))"
    );
    browser.evaluate(&set).map(|_| ())
}

/// The torque that is shown, in N·m.
const TORQUE: &str = "+document.querySelector('#numbers b i').textContent.replace('−', '-')";

/// A slider, the key of the motor's views, and the values by slider, by key and by slider again.
type Moved<'a> = (&'a str, &'a str, [i32; 3]);

/// Sliders and keys move the torque; a speed slider only where the free rotor stays, so that it is only set.
fn moves(browser: &mut Browser, moved: &[Moved]) -> Result<()> {
    for (slider, key, [first, by_key, last]) in moved {
        if !key.is_empty() {
            browser.press(key)?;
        }
        if slider.contains("speed") {
            set(browser, slider, *first)?;
            continue;
        }
        for (what, act, wanted) in
            [("slider", Some(first), first), ("key", None, by_key), ("slider", Some(last), last)]
        {
            match act {
                Some(value) => set(browser, slider, *value)?,
                None => browser.press("ArrowUp")?,
            }
            let near = format!("Math.abs({TORQUE} - {wanted}) < {}", if wanted.abs() < 100 { 2 } else { 12 });
            browser.until(&format!("torque near {wanted} N·m by {what}"), &near)?;
            println!("torque {} N·m by {what}", browser.evaluate(TORQUE)?);
        }
    }
    Ok(())
}

/// Each fault of the campaign has one button.
fn has_its_faults(browser: &mut Browser) -> Result<()> {
    const WRONG: &str =
        "tractive.faults.filter(name => document.querySelectorAll(`[data-fault=\"${name}\"]`).length !== 1)";
    let wrong = browser.evaluate(WRONG)?;
    ensure!(wrong.as_array().is_some_and(Vec::is_empty), "faults without a button of their own: {wrong}");
    println!("a button each for {} faults", browser.evaluate("tractive.faults.length")?);
    Ok(())
}

/// A fault is injected, named, mended, acknowledged, and the drive runs again.
fn trips(browser: &mut Browser, fault: &str) -> Result<()> {
    has_its_faults(browser)?;
    browser.evaluate(&format!("document.querySelector('[data-fault={fault}]').click()"))?;
    browser.until(
        "the fault is named",
        "/^(overcurrent|sensor_lost_2|angle_lost) value [\\d.,]+ (A|rad), limit [\\d.,]+ (A|rad) /.test(document.getElementById('fault').innerText.replace(/\\s+/g, ' '))",
    )?;
    println!("{}", browser.evaluate("document.getElementById('fault').innerText.replace(/\\s+/g, ' ')")?);
    for button in ["mend", "acknowledge"] {
        browser.evaluate(&format!("document.getElementById('{button}').click()"))?;
    }
    browser.until("it runs again", RUNNING)
}

/// The recording is saved with all its rows, as CSV and as MCAP, which a library reads back.
fn saves(browser: &mut Browser) -> Result<()> {
    browser.evaluate("document.getElementById('record').click()")?;
    std::thread::sleep(Duration::from_millis(500));
    browser.evaluate("document.getElementById('record').click()")?;
    const CSV: &str = "tractive.csv().text()";
    const MCAP: &str = "new Promise(done => { const reader = new FileReader(); reader.onload = () => done(reader.result.split(',')[1]); reader.readAsDataURL(tractive.mcap()); })";
    let csv = browser.evaluate(CSV)?.as_str().context("no CSV")?.to_owned();
    let mut lines = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let heads = lines.next().context("an empty CSV")?;
    let bytes =
        base64::prelude::BASE64_STANDARD.decode(browser.evaluate(MCAP)?.as_str().context("no MCAP")?)?;
    let mut count = 0;
    for (message, line) in mcap::MessageStream::new(&bytes)?.zip(lines.by_ref()) {
        let message = message?;
        let row: serde_json::Value = serde_json::from_slice(&message.data)?;
        let time_s: f64 = line[0].parse()?;
        ensure!((message.log_time as f64 * 1e-9 - time_s).abs() < 1e-9, "row {count}: {time_s} s in the CSV");
        for (head, value) in heads.iter().zip(&line).skip(1) {
            ensure!(row[*head].as_f64() == value.parse().ok(), "row {count}, {head}: {value} in the CSV");
        }
        count += 1;
    }
    ensure!(count > 1_000 && lines.next().is_none(), "{count} rows in the MCAP, more in the CSV");
    println!("{count} rows recorded, the same as CSV and as MCAP");
    Ok(())
}

/// Scenarios in the page make the host's bytes, and its verdicts; what the host refuses is refused.
fn equal_the_host(browser: &mut Browser, rig: &Path, lines: &[&str]) -> Result<()> {
    let offered = browser
        .evaluate("[...document.querySelector('select[aria-label=Scenario]').options].map(of => of.value)")?;
    for name in offered.as_array().into_iter().flatten().filter_map(Value::as_str) {
        ensure!(
            lines.iter().any(|line| line.split(' ').next() == Some(name)),
            "{name}: not compared with the host"
        );
    }
    let out = tempfile::tempdir()?;
    for line in lines {
        let words = line.split(' ').collect::<Vec<_>>();
        let mut host = Command::new(rig);
        host.arg("run").args(&words).args(["--on", "host", "--out"]).arg(out.path());
        host.stdout(Stdio::null()).stderr(Stdio::null()).status()?;
        let read =
            |name: &str| std::fs::read(out.path().join(name)).with_context(|| format!("{line}: no {name}"));
        let sha256: String =
            Sha256::digest(read("trace.csv")?).iter().map(|byte| format!("{byte:02x}")).collect();
        let verdicts = &serde_json::from_slice::<Value>(&read("summary.json")?)?["figures"]["verdicts"];
        let ran = in_the_page(browser, &words)?;
        ensure!(ran["sha256"] == sha256, "{line}, trace.csv: {ran} in the page, {sha256} on the host");
        ensure!(alike(&ran["verdicts"], verdicts), "{line}: {ran} in the page, {verdicts} on the host");
        println!("{line}: {}", browser.evaluate("document.getElementById('sum').textContent")?);
    }
    let refused = in_the_page(browser, &["sweep", "--to", "none"])?;
    ensure!(refused.as_str().is_some_and(|said| said.contains("--to")), "not refused: {refused}");
    browser.evaluate("document.getElementById('run').click()")?;
    browser.until("the button runs one", "!!document.getElementById('sum').dataset.sha256")
}

/// `true` where the verdicts are the same: what is found may differ in a last digit, by the sine that figures are made with.
fn alike(one: &Value, other: &Value) -> bool {
    let (Some(one), Some(other)) = (one.as_array(), other.as_array()) else { return false };
    let number = |of: &Value| of.as_f64().unwrap_or(f64::NAN);
    let near = |one: f64, other: f64| {
        one.is_nan() && other.is_nan() || (one - other).abs() <= 1e-6 * (1.0 + one.abs())
    };
    one.len() == other.len()
        && one.iter().zip(other).all(|(one, other)| {
            one["what"] == other["what"]
                && one["verdict"] == other["verdict"]
                && ["found", "at_most", "at_least"]
                    .iter()
                    .all(|key| near(number(&one[*key]), number(&other[*key])))
        })
}

/// Answer of the page to a scenario with its words.
fn in_the_page(browser: &mut Browser, words: &[&str]) -> Result<Value> {
    let (name, words) = (json!(words[0]), json!(words[1..]));
    browser.evaluate(&format!(
        "globalThis.said = null; tractive.run({name}, {words}).then(of => {{ globalThis.said = of; }}, of => {{ globalThis.said = of.message; }}); 0"
    ))?;
    browser.until("the scenario is done", "!!globalThis.said")?;
    browser.evaluate("globalThis.said")
}

/// Size of the smallest letters, in CSS pixels.
const LETTERS: &str = "Math.min(...[...document.querySelectorAll('body *')].filter(e => e.getClientRects().length && [...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim())).map(e => parseFloat(getComputedStyle(e).fontSize)))";

/// Nothing is wider than the window, no letter under 11 pixels.
fn fits(browser: &mut Browser) -> Result<()> {
    for width in WIDTHS {
        browser.resize(width, 860, false)?;
        std::thread::sleep(Duration::from_millis(400));
        let wide =
            browser.evaluate("Math.max(document.documentElement.scrollWidth, document.body.scrollWidth)")?;
        ensure!(wide.as_u64() <= Some(width.into()), "at {width} pixels the page is {wide} wide");
        let small = browser.evaluate(LETTERS)?;
        ensure!(small.as_f64() >= Some(11.0), "at {width} pixels there are letters of {small} pixels");
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

/// The pace with the scope running, and its frames: told, not judged.
fn runs(browser: &mut Browser) -> Result<()> {
    const RATE: &str = "(r => { r.value = 'VALUE'; r.onchange(); })(document.getElementById('rate'))";
    browser.evaluate(&RATE.replace("VALUE", "Infinity"))?;
    let before = browser.evaluate("+document.body.dataset.frames")?.as_f64().unwrap_or(0.0);
    let began = std::time::Instant::now();
    std::thread::sleep(Duration::from_secs(3));
    let frames = browser.evaluate("+document.body.dataset.frames")?.as_f64().unwrap_or(0.0) - before;
    let said = browser
        .evaluate("document.getElementById('numbers').lastElementChild.innerText.replace(/\\s+/g, ' ')")?;
    println!("as fast as it goes: {said}; {:.0} frames a second", frames / began.elapsed().as_secs_f64());
    browser.evaluate(&RATE.replace("VALUE", "1")).map(|_| ())
}
