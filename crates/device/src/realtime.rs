//! Real-time priority and locked memory for the loop, where the system permits, and words about it.

use std::fmt;

/// What came of one wish.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Granted {
    /// It was granted: what.
    Yes(String),
    /// It was not.
    No {
        /// What was not granted, and what the system said.
        what: String,
        /// What the user can do about it.
        mend: String,
    },
}

/// What the system granted a loop. Printed, it is a line for each wish, with the mend where one is needed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Realtime {
    /// Priority of the thread that asked.
    pub priority: Granted,
    /// Whether the program's memory stays in memory.
    pub memory: Granted,
}

impl Realtime {
    /// Asks for both, for the calling thread and for the whole program. To be called on the loop's thread before the
    /// loop begins and after its memory was taken: all pages are fetched, which may take a second.
    ///
    /// Nothing depends on either but how often a period is late.
    #[must_use]
    pub fn ask() -> Self {
        Self {
            priority: priority_of_loop(),
            memory: memory(),
        }
    }

    /// Were both granted?
    #[must_use]
    pub fn is_full(&self) -> bool {
        let is_yes = |granted: &Granted| matches!(granted, Granted::Yes(_));
        is_yes(&self.priority) && is_yes(&self.memory)
    }
}

impl fmt::Display for Granted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Yes(what) => f.write_str(what),
            Self::No { what, mend } => write!(f, "{what}; {mend}"),
        }
    }
}

impl fmt::Display for Realtime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}\n{}", self.priority, self.memory)
    }
}

/// On a single core a loop that nothing may interrupt would hold up the very driver it waits for.
fn has_cores() -> bool {
    std::thread::available_parallelism().is_ok_and(|n| n.get() > 1)
}

/// Asks for real-time priority for the calling thread alone.
#[must_use]
pub fn priority_of_loop() -> Granted {
    if !has_cores() {
        return Granted::No {
            what: "no real-time priority: there is one core alone".to_owned(),
            mend: "run on a machine with two cores or more".to_owned(),
        };
    }
    match raise_priority() {
        Ok(what) => Granted::Yes(what),
        Err(what) => Granted::No {
            what: format!("no real-time priority ({what})"),
            mend: PRIORITY_MEND.to_owned(),
        },
    }
}

/// Of 1 to 99: above the interrupt threads of a real-time kernel (50), below its watchdogs.
#[cfg(target_os = "linux")]
const PRIORITY: u8 = 70;

#[cfg(target_os = "linux")]
const PRIORITY_MEND: &str = "to permit it, put the line \"@realtime - rtprio 90\" into \
     /etc/security/limits.d/99-realtime.conf, be in the group realtime, and log in again";

#[cfg(not(target_os = "linux"))]
const PRIORITY_MEND: &str = "run the program with the rights to raise its priority";

#[cfg(target_os = "linux")]
fn raise_priority() -> Result<String, String> {
    use rustix::process::{Resource, getrlimit};
    use thread_priority::unix::{
        RealtimeThreadSchedulePolicy, ThreadSchedulePolicy, set_thread_priority_and_policy,
        thread_native_id,
    };
    use thread_priority::{ThreadPriority, ThreadPriorityValue};

    let value = ThreadPriorityValue::try_from(PRIORITY).map_err(|e| e.to_string())?;
    set_thread_priority_and_policy(
        thread_native_id(),
        ThreadPriority::Crossplatform(value),
        ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo),
    )
    .map_err(|_| {
        // Without a limit set it is 0, and the system refuses.
        let limit = getrlimit(Resource::Rtprio).current.unwrap_or(99);
        format!("the system permits priorities up to {limit}, {PRIORITY} is wanted")
    })?;
    Ok(format!("real-time priority {PRIORITY} (SCHED_FIFO)"))
}

#[cfg(not(target_os = "linux"))]
fn raise_priority() -> Result<String, String> {
    thread_priority::ThreadPriority::Max
        .set_for_current()
        .map(|()| "the highest priority of a thread".to_owned())
        .map_err(|e| format!("{e:?}"))
}

#[cfg(target_os = "linux")]
fn memory() -> Granted {
    use rustix::mm::{MlockAllFlags, mlockall};
    use rustix::process::{Resource, getrlimit};

    // With a limit, locking what is to come would make a later request for memory fail.
    let limit = getrlimit(Resource::Memlock).current;
    let (flags, words) = match limit {
        None => (
            MlockAllFlags::CURRENT | MlockAllFlags::FUTURE,
            "all memory is locked",
        ),
        Some(_) => (MlockAllFlags::CURRENT, "the memory taken so far is locked"),
    };
    match mlockall(flags) {
        Ok(()) => Granted::Yes(words.to_owned()),
        Err(error) => {
            let permitted = limit.map_or("all".to_owned(), |bytes| format!("{} KiB", bytes >> 10));
            Granted::No {
                what: format!("memory is not locked ({error}; the system permits {permitted})"),
                mend: "to permit it, put the line \"@realtime - memlock unlimited\" into \
                       /etc/security/limits.d/99-realtime.conf, be in the group realtime, and log in again"
                    .to_owned(),
            }
        }
    }
}

#[cfg(not(target_os = "linux"))]
fn memory() -> Granted {
    Granted::No {
        what: "memory is not locked: not done on this system".to_owned(),
        mend: "close programs that need much memory".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is granted depends on the machine; that it is told truly does not.
    #[test]
    fn what_is_told_is_what_the_system_says() {
        let told = std::thread::spawn(|| (Realtime::ask(), is_realtime()))
            .join()
            .unwrap();
        let (granted, is_realtime) = told;
        assert_eq!(
            matches!(granted.priority, Granted::Yes(_)),
            is_realtime,
            "{granted}"
        );
        let text = granted.to_string();
        assert_eq!(text.lines().count(), 2, "{text}");
        for one in [&granted.priority, &granted.memory] {
            if let Granted::No { what, mend } = one {
                assert!(!what.is_empty() && !mend.is_empty());
                assert!(text.contains(mend.as_str()));
            }
        }
        if let Granted::Yes(what) = &granted.memory {
            assert!(what.contains("locked"));
        }
        // The other tests go on with memory that may be moved.
        #[cfg(target_os = "linux")]
        let _not_locked = rustix::mm::munlockall();
    }

    #[cfg(target_os = "linux")]
    fn is_realtime() -> bool {
        use thread_priority::unix::{ThreadSchedulePolicy, thread_schedule_policy};
        matches!(
            thread_schedule_policy(),
            Ok(ThreadSchedulePolicy::Realtime(_))
        )
    }

    #[cfg(not(target_os = "linux"))]
    fn is_realtime() -> bool {
        matches!(priority(), Granted::Yes(_))
    }

    #[test]
    fn both_are_needed_to_be_full() {
        let yes = || Granted::Yes("yes".to_owned());
        let no = || Granted::No {
            what: "no".to_owned(),
            mend: "do this".to_owned(),
        };
        let of = |priority, memory| Realtime { priority, memory };
        assert!(of(yes(), yes()).is_full());
        assert!(!of(yes(), no()).is_full() && !of(no(), yes()).is_full());
        assert_eq!(of(yes(), no()).to_string(), "yes\nno; do this");
    }
}
