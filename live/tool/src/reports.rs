//! The checks of report pages in a browser: opened as files, without a server.

use crate::browser::Browser;
use crate::pictures;
use anyhow::{Context, Result, ensure};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Widths of a window, in CSS pixels.
const WIDTHS: [u32; 2] = [1280, 390];
/// Largest page of a run, in bytes.
const LARGEST_BYTES: u64 = 3_000_000;

/// What is wrong with the page as it is shown: too wide, letters under 11 px, contrast under 4.5 to 1, 3 to 1 of large letters.
const COMPLAINTS: &str = include_str!("reports.js");

/// Checks report pages; with a folder, takes pictures of their first window as well.
pub fn check(pages: &[PathBuf], folder: Option<&Path>, program: &Path) -> Result<()> {
    for page in pages {
        let name = page.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy().into_owned();
        let page = std::path::absolute(page)?;
        let bytes = std::fs::metadata(&page).with_context(|| page.display().to_string())?.len();
        ensure!(bytes <= LARGEST_BYTES, "{}: {bytes} bytes, at most {LARGEST_BYTES}", page.display());
        let mut browser = Browser::start(program)?;
        browser.resize(WIDTHS[0], 900, false)?;
        browser.go(&format!("file://{}", page.display()))?;
        browser.until("the page draws", "!!document.body?.dataset.drawn")?;
        let drawn_ms = browser.evaluate("+document.body.dataset.drawn")?;
        println!("{name}: {bytes} bytes, first plots after {drawn_ms} ms");
        browser.evaluate("report.all().length")?;
        for width in WIDTHS {
            for dark in [false, true] {
                browser.resize(width, 900, dark)?;
                std::thread::sleep(std::time::Duration::from_millis(400));
                let wrong = browser.evaluate(COMPLAINTS)?;
                ensure!(
                    wrong.as_array().is_some_and(Vec::is_empty),
                    "{name} at {width} pixels, dark {dark}: {wrong}"
                );
                if let Some(out) = folder {
                    let file = out
                        .join(format!("report-{name}-{width}-{}.png", if dark { "dark" } else { "light" }));
                    pictures::save(&browser.picture()?, &file)?;
                }
            }
        }
        browser.resize(WIDTHS[0], 900, false)?;
        zooms(&mut browser, &name)?;
        ensure!(browser.errors.is_empty(), "{name}: errors on the console: {:?}", browser.errors);
    }
    Ok(())
}

/// The first plots zoom until each row stands for itself, and where there are edges, until one edge is alone; and back.
fn zooms(browser: &mut Browser, name: &str) -> Result<()> {
    const ZOOM: &str = "(async () => {
        const scope = report.scopes[0], frame = () => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
        const edges = scope.plan.panels.findIndex((p, n) => p.series[0].style === 'edges' && scope.curves[n][0].times.rows > 100);
        const panel = Math.max(0, edges);
        const curve = scope.curves[panel][0], [from, to] = scope.full, all = curve.times.rows;
        const k = all >> 1, at = curve.times.of(k);
        const whole = scope.plots[panel].data[0].length;
        let longest = 0, frames = 0;
        const narrow = Math.min(1e-4, 8 * (curve.times.every || 1));
        for (let width = to - from; width > narrow; width *= 0.7) {
            const began = performance.now();
            scope.shown = [at - width / 2, at + width / 2];
            scope.draw();
            longest = Math.max(longest, performance.now() - began);
            frames += 1;
            await frame();
        }
        const data = scope.plots[panel].data, shown = data[0].length;
        const raw = data[0].every((t, n) => data[1][n] === curve.values[curve.times.row(data[0][0] + 0) + n] || curve.times.at);
        const edge = curve.times.at ? data[0].some(t => t === at) : raw;
        scope.show(...scope.home);
        await frame();
        return { all, whole, shown, edge, longest: Math.round(longest), frames, back: scope.shown[0] === scope.home[0] };
    })()";
    let said = browser.evaluate(ZOOM)?;
    let number = |field: &str| said[field].as_u64().with_context(|| format!("{name}: {said}"));
    let (all, whole, shown) = (number("all")?, number("whole")?, number("shown")?);
    ensure!(whole <= 20_000, "{name}: {whole} points are drawn of the whole: {said}");
    ensure!(
        shown < 40 && shown < all,
        "{name}: {shown} points of {all} are shown where few are left: {said}"
    );
    ensure!(said["edge"] == Value::Bool(true), "{name}: the value in the middle is not its own: {said}");
    ensure!(said["back"] == Value::Bool(true), "{name}: the zoom does not return: {said}");
    println!(
        "{name}: {all} values drawn as {whole}; zoomed to {shown} in {} frames, the longest {} ms",
        said["frames"], said["longest"]
    );
    Ok(())
}
