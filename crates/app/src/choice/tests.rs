use std::fs;
use std::time::Duration;

use super::*;
use crate::scene::Accuracy;

const N_ROWS: usize = 40;
const N_CANDIDATES: usize = 6;

fn layout() -> Layout {
    Layout::new(N_ROWS, N_CANDIDATES).unwrap()
}

/// About 1 mm/N; of one sign, so that rounding stays small beside the sum.
fn blocks() -> Vec<f64> {
    (0..layout().n_scalars())
        .map(|k| 1e-3 * (1.0 + 0.5 * (0.7 * k as f64).sin()))
        .collect()
}

fn accuracy(multiply: Multiply, scalar: MultiplyScalar) -> Accuracy {
    Accuracy {
        multiply,
        scalar,
        ..Accuracy::of(None)
    }
}

fn product(multiplier: &mut Multiplier) -> Vec<f64> {
    let mut u = vec![0.0; 3 * N_ROWS];
    multiplier
        .get()
        .multiply_into(&[1, 4], &[1.0, 2.0, 3.0, 0.5, 0.0, 1.0], &mut u)
        .unwrap();
    u
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    let largest = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max) / largest
}

fn no_adapters() -> Adapters {
    let mut adapters = Adapters::find();
    adapters.list.clear();
    adapters
}

#[test]
fn cpu_and_64_bits_are_the_processor_and_say_why() {
    let blocks = blocks();
    let of =
        |multiply, scalar| choose(layout(), &[&blocks], &accuracy(multiply, scalar), None).unwrap();
    let (mut multiplier, choice) = of(Multiply::Cpu, MultiplyScalar::Auto);
    assert!(!multiplier.is_on_gpu());
    assert_eq!(multiplier.get().bytes(), 8 * layout().n_scalars() as u64);
    assert_eq!(choice.words(), "the processor, 64 bits, as asked for");
    let (_, choice) = of(Multiply::Auto, MultiplyScalar::F64);
    assert_eq!(
        choice.words(),
        "the processor, 64 bits: a GPU keeps no 64-bit numbers (scalar)"
    );
    // 16 bits are a GPU's.
    let (mut multiplier, choice) = of(Multiply::Cpu, MultiplyScalar::F16);
    assert_eq!(multiplier.get().bytes(), 4 * layout().n_scalars() as u64);
    assert_eq!(choice.words(), "the processor, 32 bits, as asked for");
}

#[test]
fn without_an_adapter_auto_is_the_processor_and_gpu_an_error_that_names_what_was_looked_for() {
    let (blocks, none) = (blocks(), no_adapters());
    let blocks = [blocks.as_slice()];
    let asking = Asking::new(layout(), &blocks, MultiplyScalar::Auto);
    let (multiplier, choice) = asking.on_faster(&none, true, None).unwrap();
    assert!(!multiplier.is_on_gpu());
    assert!(choice.warning().is_none());
    assert_eq!(
        choice.words(),
        "the processor, 64 bits: there is no graphics adapter"
    );
    let words = choice.words_in_full();
    assert!(
        words.contains("; looked for adapters of ") && words.ends_with(", found none"),
        "{words}"
    );
    let error = asking.on_gpu(&none).err().unwrap().to_string();
    assert!(
        error.starts_with("accuracy.multiply is \"gpu\", but no graphics adapter"),
        "{error}"
    );
    assert!(error.contains("looked for adapters of "), "{error}");
}

/// On a software adapter where there is one, else the refusal is looked at: a machine without drivers tests that much.
#[test]
fn gpu_is_the_best_adapter_with_the_processor_behind_it() {
    let blocks = blocks();
    let exact = product(
        &mut choose(
            layout(),
            &[&blocks],
            &accuracy(Multiply::Cpu, MultiplyScalar::F64),
            None,
        )
        .unwrap()
        .0,
    );
    for (scalar, bits, bound) in [
        (MultiplyScalar::Auto, 32, 1e-5),
        (MultiplyScalar::F16, 16, 2e-2),
    ] {
        let chosen = choose(layout(), &[&blocks], &accuracy(Multiply::Gpu, scalar), None);
        match chosen {
            Ok((mut multiplier, choice)) => {
                assert!(multiplier.is_on_gpu() && choice.is_on_gpu);
                let words = choice.words();
                assert!(
                    words.ends_with(&format!(", {bits} bits, as asked for")),
                    "{words}"
                );
                let error = apart(&exact, &product(&mut multiplier));
                assert!(error < bound, "{words}: {error:e}");
                assert_eq!(multiplier.n_late(), 0, "{words}");
            }
            Err(error) => {
                eprintln!("no adapter: {error}");
                assert!(Adapters::find().best(true).is_err(), "{error}");
            }
        }
    }
}

/// A software adapter may compete here. Which of the two wins is not asserted; that the second run remembers is.
#[test]
fn auto_measures_once_and_remembers_whoever_won() {
    let (blocks, adapters) = (blocks(), Adapters::find());
    let blocks = [blocks.as_slice()];
    let asking = Asking::new(layout(), &blocks, MultiplyScalar::Auto);
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("not there yet");
    let of = |folder| asking.on_faster(&adapters, true, folder).unwrap();
    let (multiplier, first) = of(Some(&folder));
    if adapters.best(true).is_err() {
        eprintln!("no adapter: {adapters}");
        assert!(matches!(first.why, Why::NoAdapter { .. }), "{first:?}");
        return;
    }
    let Why::Faster(race) = &first.why else {
        panic!("{first:?}");
    };
    assert!(!race.is_remembered);
    assert_eq!(multiplier.is_on_gpu(), race.gpu_s < race.processor_s);
    assert_eq!(first.is_on_gpu, multiplier.is_on_gpu());

    let (_, second) = of(Some(&folder));
    assert_eq!(
        second.why,
        Why::Faster(Race {
            is_remembered: true,
            ..race.clone()
        })
    );
    assert!(second.words().contains("measured earlier"));

    // The file decides; a damaged one is measured again and replaced; without a folder nothing is remembered.
    let file = fs::read_dir(&folder)
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let good = fs::read_to_string(&file).unwrap();
    let with = |processor_s: f64, gpu_s: f64| {
        let mut kept: serde_json::Value = serde_json::from_str(&good).unwrap();
        kept["processor_s"] = processor_s.into();
        kept["gpu_s"] = gpu_s.into();
        fs::write(&file, kept.to_string()).unwrap();
        of(Some(&folder))
    };
    let (multiplier, choice) = with(1e-3, 1e-2);
    assert!(!multiplier.is_on_gpu());
    let words = choice.words();
    assert!(
        words.starts_with("the processor, 64 bits, 10 times faster than "),
        "{words}"
    );
    assert!(
        words.ends_with("(for 6 contacts: 1 ms against 10 ms, measured earlier)"),
        "{words}"
    );
    let (multiplier, choice) = with(3e-3, 1e-3);
    assert!(multiplier.is_on_gpu());
    let words = choice.words();
    assert!(
        words.ends_with(
            "32 bits, 3.0 times faster than the processor (for 6 contacts: 1 ms against 3 ms, measured earlier)"
        ),
        "{words}"
    );
    fs::write(&file, "{ damaged").unwrap();
    let (_, choice) = of(Some(&folder));
    assert!(matches!(choice.why, Why::Faster(race) if !race.is_remembered));
    assert!(serde_json::from_slice::<serde_json::Value>(&fs::read(&file).unwrap()).is_ok());
    let (_, choice) = of(None);
    assert!(matches!(choice.why, Why::Faster(race) if !race.is_remembered));
}

/// An adapter that cannot take the compliance: bindings so small that no candidate fits.
#[test]
fn an_adapter_that_fails_leaves_auto_to_the_processor_with_the_reason() {
    let (blocks, adapters) = (blocks(), Adapters::find());
    let blocks = [blocks.as_slice()];
    let mut asking = Asking::new(layout(), &blocks, MultiplyScalar::Auto);
    asking.settings.binding_limit = Some(16);
    let (multiplier, choice) = asking.on_faster(&adapters, true, None).unwrap();
    assert!(!multiplier.is_on_gpu());
    if adapters.best(true).is_err() {
        eprintln!("no adapter: {adapters}");
        return;
    }
    assert!(matches!(choice.why, Why::Failed { .. }), "{choice:?}");
    let warning = choice.warning().unwrap();
    assert!(
        warning.ends_with("; the processor multiplies instead"),
        "{warning}"
    );
    assert!(asking.on_gpu(&adapters).is_err());
}

/// A driver that never answers in time: nobody waits for it. The processor's numbers come at once, and after the third
/// time it is given up with a remark, once.
#[test]
fn an_adapter_that_is_late_is_given_up_with_a_remark() {
    let (blocks, adapters) = (blocks(), Adapters::find());
    let blocks = [blocks.as_slice()];
    let asking = Asking::new(layout(), &blocks, MultiplyScalar::Auto);
    let Some(mut multiplier) = impatient(layout(), &blocks) else {
        eprintln!("no adapter: {adapters}");
        assert!(adapters.best(true).is_err());
        return;
    };
    let exact = product(&mut asking.on_processor(Why::Asked).unwrap().0);
    let remark = (0..10_000).find_map(|_| {
        assert!(apart(&exact, &product(&mut multiplier)) < 1e-6);
        std::thread::sleep(Duration::from_millis(1));
        multiplier.get().take_remark()
    });
    let remark = remark.unwrap();
    assert!(
        remark.ends_with("; the processor multiplies from now on"),
        "{remark}"
    );
    assert!(multiplier.n_late() > 0);
    assert_eq!(multiplier.get().take_remark(), None);
    assert_eq!(product(&mut multiplier), exact);
}
