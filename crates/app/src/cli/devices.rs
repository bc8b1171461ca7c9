//! `snapin devices`: what is attached, what could be, and why not.

use std::io::Write;

use clap::Args;
use device::driver;
use serde_json::json;

use super::{json_text, print};
use crate::Error;

#[derive(Debug, Args)]
pub(super) struct DevicesArgs {
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &DevicesArgs, out: &mut dyn Write) -> Result<u8, Error> {
    let listings = driver::list();
    let text = if args.json {
        let list: Vec<_> = listings
            .iter()
            .map(|one| {
                json!({
                    "name": one.name,
                    "is_there": one.status.is_ok(),
                    "what": one.status.as_ref().ok(),
                    "why_not": one.status.as_ref().err().map(ToString::to_string),
                })
            })
            .collect();
        json_text(&json!({ "devices": list }))
    } else {
        table(&listings)
    };
    print(out, &text)?;
    Ok(0)
}

/// What is there first.
fn table(listings: &[driver::Listing]) -> String {
    let width = listings.iter().map(|one| one.name.len()).max().unwrap_or(0);
    let line = |one: &driver::Listing| match &one.status {
        Ok(what) => format!("ok    {:<width$}  {what}\n", one.name),
        Err(why) => format!("none  {:<width$}  {why}\n", one.name),
    };
    let (there, not): (Vec<_>, Vec<_>) = listings.iter().partition(|one| one.status.is_ok());
    there.into_iter().chain(not).map(line).collect()
}
