//! The window as a picture in the working folder.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};

use eframe::egui;

use crate::report::render::encode;

/// Pictures that were asked for.
pub(super) struct Saved {
    tell: Sender<String>,
    told: Receiver<String>,
}

impl Default for Saved {
    fn default() -> Self {
        let (tell, told) = channel();
        Self { tell, told }
    }
}

impl Saved {
    /// Asks for the next frame.
    pub(super) fn ask(&self, context: &egui::Context) {
        let tell = self.tell.clone();
        context.request_screenshot(move |image| {
            let words = match save(&image) {
                Ok(path) => format!("saved {}", path.display()),
                Err(why) => format!("the picture was not saved: {why}"),
            };
            // The window may be gone.
            let _ = tell.send(words);
        });
    }

    /// What came of them.
    pub(super) fn told(&self) -> impl Iterator<Item = String> {
        self.told.try_iter()
    }
}

/// Under the first name that is free.
fn save(image: &egui::ColorImage) -> Result<PathBuf, String> {
    let names = (1_u32..).map(|n| PathBuf::from(format!("snapin-view-{n:03}.png")));
    let mut free = names.filter(|path| !path.exists());
    let path = free.next().ok_or("no name is free")?;
    let pixels: Vec<u8> = image
        .pixels
        .iter()
        .flat_map(|p| [p.r(), p.g(), p.b()])
        .collect();
    let [width, height] = image.size;
    std::fs::write(&path, encode(&pixels, (width, height))?).map_err(|e| e.to_string())?;
    Ok(path)
}
