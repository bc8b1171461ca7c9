//! The thread that speaks to the driver, and the back-end whose calls wait for it no longer than they want to.
//!
//! Every call into a driver can hang: opening, submitting, waiting. So none is made on the caller's thread. The caller
//! leaves a job, wakes the worker, and waits with a time limit; a worker that does not come back is left behind.

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::connection::Connection;
use crate::error::Error;
use crate::plan::{Job, Panels, Storage};
use crate::wgpu_backend::OnDevice;

/// Longest wait of the worker itself for one submission; the caller has given up long before.
const LONGEST: Duration = Duration::from_secs(60);

/// Opening a device, compiling the shaders, or writing a stretch of columns takes no longer than this.
pub(crate) const PREPARING: Duration = Duration::from_secs(30);

/// Closing a device takes no longer than this.
const CLOSING: Duration = Duration::from_secs(2);

/// What the worker is to do with a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// Compute and read back for a caller who waits.
    Wait,
    /// Compute and read back for whoever asks later.
    Later,
    /// Compute and leave it on the device.
    Leave,
    /// Compute so many times in one submission and wait for that, without reading back.
    Repeat(u32),
    /// Write NaN where results go, so that a test sees which numbers are written.
    #[cfg(test)]
    Poison,
    /// Sleep as a driver that hangs does.
    #[cfg(test)]
    Hang(Duration),
    /// Destroy the device.
    #[cfg(test)]
    Lose,
    /// Ask for what no device may give.
    #[cfg(test)]
    Misuse,
}

/// A result as it was on the device.
#[derive(Debug, Default)]
pub(crate) struct Answer {
    /// Of the job.
    pub(crate) number: u64,
    pub(crate) numbers: Vec<f32>,
    /// Numbers times this are m.
    pub(crate) scale: f64,
}

struct Mailbox {
    /// Number and kind of the job that waits, if one does; its contents in `job`.
    waits: Option<(u64, Order)>,
    job: Job,
    /// Of the last finished job of any order.
    done: u64,
    /// For who waited, and for who asks later.
    answers: [Answer; 2],
    failed: Option<Error>,
    stops: bool,
}

struct Shared {
    mailbox: Mutex<Mailbox>,
    to_worker: Condvar,
    to_caller: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Mailbox> {
        self.mailbox.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn fail(&self, error: Error) {
        let mut mailbox = self.lock();
        mailbox.failed.get_or_insert(error);
        drop(mailbox);
        self.to_caller.notify_all();
    }
}

/// The caller's end.
pub(crate) struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    name: String,
    last: u64,
    /// Number of the last job to be taken later, when it was left, and that of the last answer taken.
    asked: Option<(u64, Instant)>,
    taken: u64,
}

/// What a worker tells while it prepares.
pub(crate) struct Ready {
    pub(crate) displacement: wgpu::Buffer,
}

/// The worker before its columns are there.
pub(crate) struct Preparing {
    columns: SyncSender<(usize, Vec<u8>)>,
    replies: Receiver<Result<Vec<u8>, Error>>,
    ready: Receiver<Result<Ready, Error>>,
    worker: Worker,
}

impl Preparing {
    /// Starts the thread; it opens the device with `open`, on itself.
    pub(crate) fn start(
        name: String,
        open: impl FnOnce() -> Result<Connection, Error> + Send + 'static,
        panels: Panels,
        storage: Storage,
        empty: Job,
    ) -> Result<Self, Error> {
        let shared = Arc::new(Shared {
            mailbox: Mutex::new(Mailbox {
                waits: None,
                job: empty.clone(),
                done: 0,
                answers: Default::default(),
                failed: None,
                stops: false,
            }),
            to_worker: Condvar::new(),
            to_caller: Condvar::new(),
        });
        let (columns, from_caller) = sync_channel::<(usize, Vec<u8>)>(1);
        let (reply, replies) = sync_channel(1);
        let (tell, ready) = sync_channel(1);
        let of_worker = Arc::clone(&shared);
        let of_name = name.clone();
        let work = move || {
            let end = End {
                shared: of_worker,
                name: of_name,
            };
            let mut device = match open().and_then(|c| OnDevice::new(c, panels, storage)) {
                Ok(device) => device,
                Err(error) => {
                    let _ = tell.send(Err(error));
                    return;
                }
            };
            let _ = tell.send(Ok(Ready {
                displacement: device.displacement.clone(),
            }));
            while let Ok((first, bytes)) = from_caller.recv() {
                let uploaded = device.upload(first, &bytes);
                if reply.send(uploaded.map(|()| bytes)).is_err() {
                    return;
                }
            }
            serve(&end.shared, &mut device, empty);
        };
        let spawned = std::thread::Builder::new()
            .name("snapin-gpu".to_owned())
            .spawn(work);
        let thread = spawned.map_err(|e| Error::Refused {
            adapter: name.clone(),
            reason: format!("no thread for it: {e}"),
        })?;
        Ok(Self {
            columns,
            replies,
            ready,
            worker: Worker {
                shared,
                thread: Some(thread),
                name,
                last: 0,
                asked: None,
                taken: 0,
            },
        })
    }

    /// Waits until the device is open and the shaders are compiled.
    pub(crate) fn ready(&self) -> Result<Ready, Error> {
        answer(&self.ready, &self.worker.name)?
    }

    /// Writes columns from candidate `first` on; gives the buffer back.
    pub(crate) fn upload(&self, first: usize, bytes: Vec<u8>) -> Result<Vec<u8>, Error> {
        if self.columns.send((first, bytes)).is_err() {
            return Err(gone(&self.worker.name));
        }
        answer(&self.replies, &self.worker.name)?
    }

    /// From now on the worker takes jobs.
    pub(crate) fn finish(self) -> Worker {
        self.worker
    }
}

fn answer<T>(from: &Receiver<T>, name: &str) -> Result<T, Error> {
    from.recv_timeout(PREPARING).map_err(|error| match error {
        RecvTimeoutError::Timeout => timed_out(name, PREPARING),
        RecvTimeoutError::Disconnected => gone(name),
    })
}

fn timed_out(name: &str, after: Duration) -> Error {
    Error::TimedOut {
        adapter: name.to_owned(),
        milliseconds: after.as_millis() as u64,
    }
}

fn gone(name: &str) -> Error {
    Error::DeviceLost {
        adapter: name.to_owned(),
        reason: "its driver failed".to_owned(),
    }
}

impl Worker {
    /// Leaves a job in exchange for one that is no longer used. A job that waits still is dropped for it.
    pub(crate) fn leave(&mut self, job: &mut Job, order: Order) -> Result<u64, Error> {
        let mut mailbox = self.shared.lock();
        if let Some(error) = &mailbox.failed {
            return Err(error.clone());
        }
        self.last += 1;
        // One that is under way stays the one that is waited for, however often another is asked for meanwhile.
        let is_open = self.asked.is_some_and(|(number, _)| mailbox.done < number);
        if order == Order::Later && !is_open {
            self.asked = Some((self.last, Instant::now()));
        }
        std::mem::swap(&mut mailbox.job, job);
        mailbox.waits = Some((self.last, order));
        drop(mailbox);
        self.shared.to_worker.notify_one();
        Ok(self.last)
    }

    /// Waits until a job is done, not longer than `patience`.
    pub(crate) fn wait(&self, number: u64, patience: Duration) -> Result<(), Error> {
        let not_yet = |mailbox: &mut Mailbox| mailbox.failed.is_none() && mailbox.done < number;
        let (mailbox, waited) = self
            .shared
            .to_caller
            .wait_timeout_while(self.shared.lock(), patience, not_yet)
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(error) = &mailbox.failed {
            return Err(error.clone());
        }
        if waited.timed_out() {
            return Err(timed_out(&self.name, patience));
        }
        Ok(())
    }

    /// Whether a job is not done yet.
    pub(crate) fn is_busy(&self) -> bool {
        let mailbox = self.shared.lock();
        mailbox.failed.is_none() && mailbox.done < self.last
    }

    /// Whether an order has not been taken yet.
    #[cfg(test)]
    pub(crate) fn has_order(&self) -> bool {
        self.shared.lock().waits.is_some()
    }

    /// Hands the answer of a job that was waited for to `take`.
    pub(crate) fn take(&self, take: impl FnOnce(&Answer)) {
        take(&self.shared.lock().answers[0]);
    }

    /// Hands the newest answer to `take`, if there is one that was not taken.
    pub(crate) fn take_newest(
        &mut self,
        patience: Duration,
        take: impl FnOnce(&Answer),
    ) -> Result<bool, Error> {
        let mailbox = self.shared.lock();
        if let Some(error) = &mailbox.failed {
            return Err(error.clone());
        }
        let answer = &mailbox.answers[1];
        if answer.number > self.taken {
            self.taken = answer.number;
            take(answer);
            return Ok(true);
        }
        let is_late =
            |(number, left): &(u64, Instant)| mailbox.done < *number && left.elapsed() > patience;
        if self.asked.as_ref().is_some_and(is_late) {
            self.asked = None;
            return Err(timed_out(&self.name, patience));
        }
        Ok(false)
    }
}

impl Worker {
    /// Asks the thread to end; does not wait for it.
    pub(crate) fn stop(&self) {
        self.shared.lock().stops = true;
        self.shared.to_worker.notify_one();
    }
}

impl Drop for Worker {
    /// Waits for the thread, since drivers fail where a device is closed while the program ends; not for one that hangs.
    fn drop(&mut self) {
        self.stop();
        let begun = Instant::now();
        while let Some(thread) = self.thread.take_if(|_| begun.elapsed() < CLOSING) {
            if thread.is_finished() {
                // A panic has been told as a failure already.
                let _ = thread.join();
            } else {
                self.thread = Some(thread);
                std::thread::sleep(Duration::from_micros(100));
            }
        }
    }
}

/// Says that the worker is gone, however it ends: a panic in a driver's layer too.
struct End {
    shared: Arc<Shared>,
    name: String,
}

impl Drop for End {
    fn drop(&mut self) {
        self.shared.fail(gone(&self.name));
    }
}

/// Takes jobs until it is stopped or the device fails.
fn serve(shared: &Shared, device: &mut OnDevice, mut job: Job) {
    let mut numbers = Vec::new();
    loop {
        let mut mailbox = shared
            .to_worker
            .wait_while(shared.lock(), |mailbox| {
                mailbox.waits.is_none() && !mailbox.stops
            })
            .unwrap_or_else(PoisonError::into_inner);
        let Some((number, order)) = mailbox.waits.take().filter(|_| !mailbox.stops) else {
            return;
        };
        std::mem::swap(&mut mailbox.job, &mut job);
        drop(mailbox);
        if let Err(error) = obey(device, &job, order, &mut numbers) {
            shared.fail(error);
            return;
        }
        let mut mailbox = shared.lock();
        if let Order::Wait | Order::Later = order {
            let answer = &mut mailbox.answers[usize::from(order == Order::Later)];
            answer.number = number;
            answer.scale = job.scale;
            std::mem::swap(&mut answer.numbers, &mut numbers);
        }
        mailbox.done = number;
        drop(mailbox);
        shared.to_caller.notify_all();
    }
}

fn obey(
    device: &mut OnDevice,
    job: &Job,
    order: Order,
    numbers: &mut Vec<f32>,
) -> Result<(), Error> {
    match order {
        Order::Wait | Order::Later => {
            let submitted = device.submit(job, true)?;
            device.read(submitted, LONGEST, numbers)
        }
        Order::Leave => device.submit(job, false).map(|_| ()),
        Order::Repeat(times) => {
            let submitted = device.submit_repeated(job, times, false)?;
            device.read(submitted, LONGEST, numbers)
        }
        #[cfg(test)]
        Order::Poison => device.poison(),
        #[cfg(test)]
        Order::Hang(time) => {
            std::thread::sleep(time);
            Ok(())
        }
        #[cfg(test)]
        Order::Lose => {
            device.connection.device.destroy();
            device.submit(job, false).map(|_| ())
        }
        #[cfg(test)]
        Order::Misuse => device.misuse(),
    }
}
