//! A stand-in for the Inverse Service: answers each frame with one state and looks at what it is sent.

use std::collections::VecDeque;
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use glam::DVec3;
use serde_json::{Value, json};
use tungstenite::{Error, Message, WebSocket};

use super::recording;

/// What the service does with settings.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Settings {
    /// Takes them, and tells those in force.
    Taken,
    /// Keeps its own, and tells those.
    Refused,
    /// Says nothing of them.
    PassedOver,
}

/// What the test tells the service.
#[derive(Clone)]
pub(super) struct Manner {
    /// First frame; none: it says nothing.
    pub(super) inventory: Option<Value>,
    pub(super) answer: Value,
    /// Answers to be given one after another instead, as they stand.
    pub(super) script: Vec<String>,
    /// The member in which it takes a force.
    pub(super) takes: &'static str,
    /// The share of a force that it renders while its gate is closed.
    pub(super) gate: f64,
    /// What it does with settings.
    pub(super) settings: Settings,
    /// It hears and does not answer.
    pub(super) is_mute: bool,
    /// Its events have ended.
    pub(super) is_without_events: bool,
    /// It has been killed.
    pub(super) is_down: bool,
    /// Waits before it answers.
    pub(super) pause: Duration,
    /// States that nobody asked for, after each answer.
    pub(super) unasked: usize,
    /// The cursor's x is the number of the answer, times `NUMBERED` m.
    pub(super) is_numbered: bool,
}

pub(super) const NUMBERED: f64 = 1e-5;

impl Default for Manner {
    fn default() -> Self {
        Self {
            inventory: Some(recording::inventory()),
            answer: recording::answer(),
            script: Vec::new(),
            takes: "vector",
            gate: 0.3,
            settings: Settings::Taken,
            is_mute: false,
            is_without_events: false,
            is_down: false,
            pause: Duration::ZERO,
            unasked: 0,
            is_numbered: false,
        }
    }
}

/// What the service saw.
#[derive(Default)]
pub(super) struct Seen {
    pub(super) frames: Vec<Value>,
    /// Frames with a force that came before the one before was answered.
    pub(super) early: usize,
    /// Forces that were heard and not answered.
    pub(super) unanswered: usize,
    pub(super) connections: usize,
    /// Connections that said goodbye.
    pub(super) goodbyes: usize,
    /// Connections that ended, one way or another.
    pub(super) ended: usize,
    /// What the device renders, N.
    pub(super) rendered: DVec3,
    pub(super) gate_is_open: bool,
}

impl Seen {
    /// The forces of all frames that have one, N.
    pub(super) fn forces(&self) -> Vec<DVec3> {
        self.frames
            .iter()
            .filter_map(|frame| force_of(frame, "vector").or(force_of(frame, "values")))
            .collect()
    }

    pub(super) fn last_force(&self) -> Option<DVec3> {
        self.forces().last().copied()
    }
}

pub(super) struct Mock {
    shared: Arc<Shared>,
    pub(super) port: u16,
    pub(super) events_port: u16,
    threads: Vec<JoinHandle<()>>,
}

struct Shared {
    manner: Mutex<Manner>,
    seen: Mutex<Seen>,
    events: Mutex<Vec<String>>,
    events_heard: AtomicBool,
    quit: AtomicBool,
}

impl Mock {
    pub(super) fn start(manner: Manner) -> Self {
        let simulation = TcpListener::bind("127.0.0.1:0").unwrap();
        let events = TcpListener::bind("127.0.0.1:0").unwrap();
        let port_of = |listener: &TcpListener| listener.local_addr().unwrap().port();
        let (port, events_port) = (port_of(&simulation), port_of(&events));
        let shared = Arc::new(Shared {
            manner: Mutex::new(manner),
            seen: Mutex::default(),
            events: Mutex::default(),
            events_heard: AtomicBool::new(false),
            quit: AtomicBool::new(false),
        });
        let threads = [
            (simulation, serve_simulation as fn(TcpStream, &Shared)),
            (events, serve_events),
        ]
        .into_iter()
        .map(|(listener, serve)| {
            let shared = Arc::clone(&shared);
            std::thread::spawn(move || accept(&listener, &shared, serve))
        })
        .collect();
        Self {
            shared,
            port,
            events_port,
            threads,
        }
    }

    /// Name of a device there, without the family.
    pub(super) fn place(&self, id: &str) -> String {
        format!("{id}@127.0.0.1:{},{}", self.port, self.events_port)
    }

    pub(super) fn tell(&self, change: impl FnOnce(&mut Manner)) {
        change(&mut locked(&self.shared.manner));
    }

    pub(super) fn seen<T>(&self, look: impl FnOnce(&Seen) -> T) -> T {
        look(&locked(&self.shared.seen))
    }

    pub(super) fn forget(&self) {
        locked(&self.shared.seen).frames.clear();
    }

    /// Sends an event as soon as somebody listens.
    pub(super) fn send_event(&self, name: &str, level: &str, data: Value) {
        let event = json!({"name": name, "category": "device", "level": level, "data": data, "message": "own words"});
        locked(&self.shared.events).push(event.to_string());
    }

    pub(super) fn hears_of_events(&self) -> bool {
        self.shared.events_heard.load(Ordering::Acquire)
    }
}

impl Drop for Mock {
    fn drop(&mut self) {
        self.shared.quit.store(true, Ordering::Release);
        for thread in self.threads.drain(..) {
            let ended = thread.join();
            if !std::thread::panicking() {
                ended.unwrap();
            }
        }
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    fn manner(&self) -> Manner {
        locked(&self.manner).clone()
    }

    fn has_ended(&self) -> bool {
        self.quit.load(Ordering::Acquire) || locked(&self.manner).is_down
    }
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>, serve: fn(TcpStream, &Shared)) {
    listener.set_nonblocking(true).unwrap();
    let mut served = Vec::new();
    while !shared.quit.load(Ordering::Acquire) {
        match listener.accept() {
            Ok((stream, _)) => {
                stream.set_nonblocking(false).unwrap();
                let shared = Arc::clone(shared);
                // One that is down drops whoever comes.
                if !shared.has_ended() {
                    served.push(std::thread::spawn(move || serve(stream, &shared)));
                }
            }
            Err(_) => std::thread::sleep(Duration::from_millis(1)),
        }
    }
    for thread in served {
        thread.join().unwrap();
    }
}

fn serve_simulation(stream: TcpStream, shared: &Shared) {
    stream.set_nodelay(true).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_millis(20)))
        .unwrap();
    let Ok(mut web) = tungstenite::accept(stream) else {
        return;
    };
    locked(&shared.seen).connections += 1;
    converse(&mut web, shared);
    locked(&shared.seen).ended += 1;
}

/// Until the client leaves or the service is killed.
fn converse(web: &mut WebSocket<TcpStream>, shared: &Shared) {
    if let Some(inventory) = shared.manner().inventory {
        // A client may leave at the sight of it.
        let Ok(()) = web.send(Message::text(inventory.to_string())) else {
            return;
        };
    }
    let mut early = VecDeque::new();
    while !shared.has_ended() {
        let next = early
            .pop_front()
            .map_or_else(|| web.read(), |text| Ok(Message::text::<String>(text)));
        match next {
            Ok(Message::Text(text)) => {
                let Ok(()) = answer(web, &text, &mut early, shared) else {
                    return;
                };
            }
            Ok(Message::Close(_)) => {
                locked(&shared.seen).goodbyes += 1;
                return;
            }
            Ok(_) => {}
            Err(Error::Io(e)) if e.kind() == std::io::ErrorKind::WouldBlock => {}
            Err(_) => return,
        }
    }
}

/// Takes a frame and gives its one answer.
fn answer(
    web: &mut WebSocket<TcpStream>,
    text: &str,
    early: &mut VecDeque<String>,
    shared: &Shared,
) -> tungstenite::Result<()> {
    let manner = shared.manner();
    let frame: Value = serde_json::from_str(text).unwrap();
    let (number, mut state) = {
        let mut seen = locked(&shared.seen);
        let settings = &frame["inverse3"][0]["configure"];
        if manner.settings == Settings::Taken && settings["force_gate"]["gain"] == 1.0 {
            seen.gate_is_open = true;
        }
        if let Some(force) = force_of(&frame, manner.takes) {
            let share = if seen.gate_is_open { 1.0 } else { manner.gate };
            seen.rendered = force * share;
        }
        let mut state = manner.answer.clone();
        let f = seen.rendered;
        state["inverse3"][0]["state"]["current_cursor_force"] =
            json!({"x": f.x, "y": f.y, "z": f.z});
        if settings.is_object() {
            let old = &manner.inventory.as_ref().unwrap()["inverse3"][0]["config"]["filters"];
            match manner.settings {
                Settings::Taken => state["inverse3"][0]["config"] = json!({"filters": settings}),
                Settings::Refused => state["inverse3"][0]["config"] = json!({"filters": old}),
                Settings::PassedOver => {}
            }
        }
        seen.frames.push(frame);
        if manner.is_numbered {
            let x = seen.frames.len() as f64 * NUMBERED;
            state["inverse3"][0]["state"]["cursor_position"]["x"] = json!(x);
        }
        (seen.frames.len() - 1, state.to_string())
    };
    if manner.is_mute {
        let is_force = !text.contains("session");
        locked(&shared.seen).unanswered += usize::from(is_force);
        return Ok(());
    }
    if !manner.script.is_empty() {
        state = manner.script[number.min(manner.script.len() - 1)].clone();
    }
    if !manner.pause.is_zero() {
        std::thread::sleep(manner.pause);
        note_early(web, early, shared);
    }
    web.send(Message::text(state.clone()))?;
    for _ in 0..manner.unasked {
        web.send(Message::text(state.clone()))?;
    }
    Ok(())
}

/// Is there a frame already, before the last one was answered? A zero may be, after an answer that is late.
fn note_early(web: &mut WebSocket<TcpStream>, early: &mut VecDeque<String>, shared: &Shared) {
    web.get_ref().set_nonblocking(true).unwrap();
    while let Ok(Message::Text(text)) = web.read() {
        let frame: Value = serde_json::from_str(&text).unwrap();
        let pushes = force_of(&frame, "vector").is_some_and(|force| force != DVec3::ZERO);
        locked(&shared.seen).early += usize::from(pushes);
        early.push_back(text.as_str().to_owned());
    }
    web.get_ref().set_nonblocking(false).unwrap();
}

fn serve_events(stream: TcpStream, shared: &Shared) {
    let Ok(mut web) = tungstenite::accept(stream) else {
        return;
    };
    shared.events_heard.store(true, Ordering::Release);
    while !shared.has_ended() && !shared.manner().is_without_events {
        for event in std::mem::take(&mut *locked(&shared.events)) {
            if web.send(Message::text(event)).is_err() {
                return;
            }
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn force_of(frame: &Value, member: &str) -> Option<DVec3> {
    let force = frame["inverse3"][0]["commands"]["set_cursor_force"].get(member)?;
    let [x, y, z] = ["x", "y", "z"].map(|axis| force[axis].as_f64());
    Some(DVec3::new(x?, y?, z?))
}

/// How long is waited for what must come. A loaded machine takes its time.
pub(super) const PATIENCE: Duration = Duration::from_secs(60);

/// Waits until it holds, within patience.
pub(super) fn wait_until(mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < PATIENCE, "it never came to be");
        std::thread::sleep(Duration::from_millis(1));
    }
}
