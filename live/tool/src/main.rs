//! Makes the page.
fn main() -> anyhow::Result<()> {
    let args: Vec<String> = std::env::args().collect();
    wasm_bindgen_cli_support::Bindgen::new()
        .input_path(&args[1])
        .web(true)?
        .typescript(false)
        .generate(&args[2])?;
    Ok(())
}
