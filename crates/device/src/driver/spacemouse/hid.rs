//! SpaceMice among the HID devices of the machine.

use std::ffi::CString;
use std::io;

use hidapi::{HidApi, HidDevice, HidError};

use super::Reports;
use crate::driver::Unavailable;

/// A SpaceMouse that is attached.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Found {
    /// Device file, or what the system calls it by.
    pub(super) path: String,
    /// Number of the maker.
    pub(super) vendor: u16,
    /// Number of the model.
    pub(super) product: u16,
    /// Model, as the device says; may be empty.
    pub(super) name: String,
    /// Usage page and usage, 0 where unknown.
    pub(super) usage: (u16, u16),
}

impl Found {
    /// What it is, for people.
    pub(super) fn title(&self) -> String {
        let name = match self.name.trim() {
            "" => "SpaceMouse",
            name => name,
        };
        format!("{name} ({:04x}:{:04x})", self.vendor, self.product)
    }
}

/// The maker's own number, and that of the company it belonged to.
const VENDOR: u16 = 0x256f;
const VENDOR_OLD: u16 = 0x046d;

/// Models under the old number, which mice and keyboards have as well.
const MODELS_OLD: [u16; 12] = [
    0xc603, 0xc605, 0xc606, 0xc621, 0xc623, 0xc625, 0xc626, 0xc627, 0xc628, 0xc629, 0xc62b, 0xc640,
];

/// Models under the own number that are known to have a puck.
const MODELS: [u16; 10] = [
    0xc62e, 0xc62f, 0xc631, 0xc632, 0xc633, 0xc635, 0xc638, 0xc63a, 0xc641, 0xc652,
];

/// Generic desktop, multi-axis controller: what a puck says it is. A receiver has other interfaces beside it.
const MULTI_AXIS: (u16, u16) = (1, 8);

/// Mice, keypads and their receivers under the own number.
fn is_mouse_or_keypad(product: u16) -> bool {
    matches!(product, 0xc650 | 0xc651 | 0xc653..=0xc658 | 0xc664..=0xc668)
}

fn is_puck(device: &Found) -> bool {
    let is_known = match device.vendor {
        VENDOR_OLD => MODELS_OLD.contains(&device.product),
        VENDOR => !is_mouse_or_keypad(device.product),
        _ => return false,
    };
    match device.usage {
        MULTI_AXIS => is_known,
        // Where the system tells no usage only the model can.
        (0, _) => is_known && (device.vendor == VENDOR_OLD || MODELS.contains(&device.product)),
        _ => false,
    }
}

/// Those with a puck, each device file once, in the order of their names.
pub(super) fn pucks(all: impl IntoIterator<Item = Found>) -> Vec<Found> {
    let mut found: Vec<Found> = all.into_iter().filter(is_puck).collect();
    // hidraw10 after hidraw9: shorter names first.
    found.sort_by(|a, b| (a.path.len(), &a.path).cmp(&(b.path.len(), &b.path)));
    found.dedup_by(|a, b| a.path == b.path);
    found
}

/// All that are attached.
pub(super) fn find() -> Result<Vec<Found>, Unavailable> {
    let api = api()?;
    Ok(pucks(api.device_list().filter_map(|info| {
        Some(Found {
            path: info.path().to_str().ok()?.to_owned(),
            vendor: info.vendor_id(),
            product: info.product_id(),
            name: info.product_string().unwrap_or_default().to_owned(),
            usage: (info.usage_page(), info.usage()),
        })
    })))
}

fn api() -> Result<HidApi, Unavailable> {
    HidApi::new().map_err(|e| Unavailable::Failed {
        reason: format!("the HID devices could not be listed: {e}"),
    })
}

/// Would the system let us read and write it?
pub(super) fn check_access(device: &Found) -> Result<(), Unavailable> {
    // Only on Linux is the path that of a file.
    if cfg!(target_os = "linux") {
        std::fs::OpenOptions::new()
            .read(true)
            .write(true)
            .open(&device.path)
            .map_err(|e| refusal(device, &e))?;
    }
    Ok(())
}

/// What the system's refusal means, with the rule that mends it.
pub(super) fn refusal(device: &Found, error: &io::Error) -> Unavailable {
    let Found {
        path,
        vendor,
        product,
        ..
    } = device;
    match error.kind() {
        // Both numbers: under the old one there are keyboards too, which nobody else should read.
        io::ErrorKind::PermissionDenied => Unavailable::PermissionDenied {
            path: path.clone(),
            mend: format!(
                "put the line\n  KERNEL==\"hidraw*\", ATTRS{{idVendor}}==\"{vendor:04x}\", \
                 ATTRS{{idProduct}}==\"{product:04x}\", TAG+=\"uaccess\"\ninto \
                 /etc/udev/rules.d/70-spacemouse.rules, run `sudo udevadm control --reload` and plug it in again; or \
                 install spacenavd"
            ),
        },
        io::ErrorKind::NotFound => Unavailable::NotThere {
            reason: format!("{path} is gone"),
        },
        io::ErrorKind::ResourceBusy => Unavailable::Busy {
            reason: format!("{path} is held by another program"),
        },
        _ => Unavailable::Failed {
            reason: format!("{path} could not be opened: {error}"),
        },
    }
}

/// An opened HID device.
pub(super) struct Hid(HidDevice);

impl Hid {
    pub(super) fn open(device: &Found) -> Result<Self, Unavailable> {
        check_access(device)?;
        let failed = |reason: String| Unavailable::Failed { reason };
        let path = CString::new(device.path.as_str())
            .map_err(|_| failed(format!("{} is no path", device.path)))?;
        let opened = api()?
            .open_path(&path)
            .map_err(|e| failed(format!("{} could not be opened: {e}", device.path)))?;
        Ok(Self(opened))
    }
}

impl Reports for Hid {
    fn read(&mut self, bytes: &mut [u8], timeout_ms: i32) -> io::Result<usize> {
        self.0.read_timeout(bytes, timeout_ms).map_err(system_error)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write(bytes).map(|_| ()).map_err(system_error)
    }
}

/// The system's own error where there is one: an interrupted wait is none.
fn system_error(error: HidError) -> io::Error {
    match error {
        HidError::IoError { error } => error,
        other => io::Error::other(other.to_string()),
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests;
