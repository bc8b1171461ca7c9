//! An adapter that fails, by the real cause where a test can make one: the device destroyed, a call that is not
//! allowed, a worker that sleeps, no memory.

use super::*;
use crate::guarded::Guarded;

fn guarded(adapter: &Adapter, patience: Option<Duration>) -> (Guarded, Vec<f64>) {
    let layout = Layout::new(50, 4).unwrap();
    let blocks = Numbers(23).take(layout.n_scalars());
    let asked = GpuSettings {
        patience,
        ..GpuSettings::default()
    };
    let gpu = Gpu::new(adapter, layout, &[&blocks], asked).unwrap();
    let processor = on_cpu(layout, &[&blocks], Scalar::F64).unwrap();
    let (exact, _) = reference(layout, &blocks, &[1, 3], &[1.0; 6]);
    (Guarded::new(gpu, processor), exact)
}

fn order(guarded: &mut Guarded, order: Order) {
    let gpu = guarded.gpu().unwrap();
    gpu.worker.leave(&mut gpu.job, order).unwrap();
    // An order that waits would give way to the next one.
    while gpu.worker.has_order() {
        std::thread::yield_now();
    }
}

#[test]
fn processor_takes_over_from_a_lost_device_in_the_same_call_and_it_is_said_once() {
    on_each(|adapter| {
        for fault in [Order::Lose, Order::Misuse] {
            let (mut guarded, exact) = guarded(adapter, None);
            let mut u = vec![f64::NAN; 150];
            guarded.multiply_into(&[1, 3], &[1.0; 6], &mut u).unwrap();
            assert_ne!(u, exact, "32 bits of the adapter");
            assert_eq!(guarded.take_remark(), None);
            guarded.begin(&[1, 3], &[1.0; 6]).unwrap();
            order(&mut guarded, fault);
            u.fill(f64::NAN);
            guarded.multiply_into(&[1, 3], &[1.0; 6], &mut u).unwrap();
            assert_eq!(u, exact, "64 bits of the processor");
            let remark = guarded.take_remark().unwrap();
            assert!(
                remark.contains("the processor multiplies from now on"),
                "{remark}"
            );
            assert_eq!(guarded.take_remark(), None);
            assert!(guarded.name().starts_with("cpu"));
            // What was asked for before is still there.
            u.fill(f64::NAN);
            assert!(guarded.newest_into(&mut u).unwrap());
            assert_eq!(u, exact);
            for _ in 0..3 {
                guarded.multiply_into(&[1, 3], &[1.0; 6], &mut u).unwrap();
            }
            assert_eq!(guarded.take_remark(), None);
            // The caller's mistakes stay his.
            assert!(guarded.multiply_into(&[9], &[1.0; 3], &mut u).is_err());
        }
    });
}

#[test]
fn processor_takes_over_from_a_driver_that_hangs_until_it_answers_again() {
    on_each(|adapter| {
        let patience = Duration::from_secs(1);
        let (mut guarded, exact) = guarded(adapter, Some(patience));
        let mut u = vec![f64::NAN; 150];
        order(&mut guarded, Order::Hang(patience * 5 / 2));
        let begun = Instant::now();
        guarded.multiply_into(&[1, 3], &[1.0; 6], &mut u).unwrap();
        assert!(begun.elapsed() >= patience, "the adapter had its time");
        assert_eq!(u, exact, "the processor's");
        // No call waits again while the driver hangs.
        guarded.multiply_into(&[1, 3], &[1.0; 6], &mut u).unwrap();
        assert_eq!((u.as_slice(), guarded.n_late()), (exact.as_slice(), 1));
        assert_eq!(guarded.take_remark(), None, "it is not given up yet");
        while guarded.gpu().unwrap().is_busy() {
            assert!(begun.elapsed() < PATIENT);
            std::thread::yield_now();
        }
        guarded.multiply_into(&[1, 3], &[1.0; 6], &mut u).unwrap();
        assert_ne!(u, exact, "the adapter's again");

        // In the form that does not wait, too: the frame after the time is over is the processor's.
        order(&mut guarded, Order::Hang(Duration::from_secs(3600)));
        guarded.begin(&[1, 3], &[1.0; 6]).unwrap();
        u.fill(f64::NAN);
        while !guarded.newest_into(&mut u).unwrap() {
            assert!(begun.elapsed() < PATIENT);
            std::thread::yield_now();
        }
        assert_eq!((u.as_slice(), guarded.n_late()), (exact.as_slice(), 2));
        // One that stays silent is given up.
        while guarded.gpu().is_some() {
            assert!(begun.elapsed() < PATIENT);
            guarded.multiply_into(&[1, 3], &[1.0; 6], &mut u).unwrap();
        }
        assert!(guarded.take_remark().unwrap().contains("silent"));
    });
}

#[test]
fn no_memory_is_an_error_and_not_the_end() {
    // From 0 % of the memory on every buffer is refused, where the driver tells how much it has.
    let adapters = Adapters::find_within(0);
    if adapters.list.is_empty() {
        eprintln!("no adapter: {adapters}");
        assert!(adapters.best(true).is_err());
    }
    for adapter in &adapters.list {
        let layout = Layout::new(50, 4).unwrap();
        let blocks = Numbers(29).take(layout.n_scalars());
        match Gpu::new(adapter, layout, &[&blocks], GpuSettings::default()) {
            Err(error) => {
                eprintln!("on {}: {error}", adapter.key());
                assert!(error.is_of_adapter());
                assert!(matches!(error, Error::OutOfMemory { .. }), "{error}");
            }
            Ok(_) => eprintln!("on {}: its driver does not tell its memory", adapter.key()),
        }
    }
}
