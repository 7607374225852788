//! Independent jobs on some threads, results in order.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::{DatasetError, Progress};

/// Runs `job` on every item; `weights` say how much each counts in the progress. Stops early at the
/// first error, or when `progress` answers that it should. Results do not depend on `threads`.
pub fn run<T: Sync, R: Send>(
    items: &[T],
    weights: &[f64],
    threads: usize,
    progress: &Progress<'_>,
    job: impl Fn(&T) -> Result<R, DatasetError> + Sync,
) -> Result<Vec<R>, DatasetError> {
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let done = Mutex::new(0.0);
    let total = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let results: Vec<Mutex<Option<Result<R, DatasetError>>>> =
        items.iter().map(|_| Mutex::new(None)).collect();
    let worker = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= items.len() || stop.load(Ordering::Relaxed) {
                return;
            }
            let result = job(&items[index]);
            let failed = result.is_err();
            *results[index].lock().expect("no job panics while it holds this") = Some(result);
            let mut done = done.lock().expect("progress does not panic");
            *done += weights[index];
            if failed || !progress(*done / total) {
                stop.store(true, Ordering::Relaxed);
            }
        }
    };
    std::thread::scope(|scope| {
        (1..threads.clamp(1, items.len().max(1))).for_each(|_| {
            scope.spawn(worker);
        });
        worker();
    });
    let results = results.into_iter().map(|r| r.into_inner().expect("no job panics"));
    let mut all = Vec::with_capacity(items.len());
    let mut stopped = false;
    for result in results {
        match result {
            Some(result) => all.push(result?),
            None => stopped = true,
        }
    }
    if stopped { Err(DatasetError::Stopped) } else { Ok(all) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_order_and_errors_stop() {
        let items: Vec<usize> = (0..50).collect();
        let weights = vec![1.0; 50];
        let squares = run(&items, &weights, 4, &|_| true, |&i| Ok(i * i)).unwrap();
        assert!(squares.iter().enumerate().all(|(i, &s)| s == i * i));
        let stopped = run(&items, &weights, 1, &|share| share < 0.1, |&i| Ok(i));
        assert!(matches!(stopped, Err(DatasetError::Stopped)));
        let failed = run(&items, &weights, 2, &|_| true, |&i| match i {
            7 => Err(DatasetError::Manifest("seven".into())),
            _ => Ok(i),
        });
        assert_eq!(failed.unwrap_err().to_string(), "seven");
    }
}
