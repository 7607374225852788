//! Filters along time.

use std::ops::{Add, Mul};

/// A Gaussian filter of width `sigma` in frames; beyond the ends the end values go on.
pub fn gaussian<T>(values: &[T], sigma: f32) -> Vec<T>
where
    T: Copy + Default + Add<Output = T> + Mul<f32, Output = T>,
{
    let reach = (4.0 * sigma).round() as usize;
    if reach == 0 || values.is_empty() {
        return values.to_vec();
    }
    let weight = |at: usize| (-0.5 * (at as f32 / sigma).powi(2)).exp();
    let weights: Vec<f32> = (0..=reach).map(weight).collect();
    let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f32>();
    let last = values.len() - 1;
    let filtered = |middle: usize| {
        (1..=reach).fold(values[middle] * (weights[0] / sum), |sum_so_far, at| {
            let pair = values[middle.saturating_sub(at)] + values[(middle + at).min(last)];
            sum_so_far + pair * (weights[at] / sum)
        })
    };
    (0..values.len()).map(filtered).collect()
}

/// The value below which a share of the values lies; `None` without a finite value.
pub fn quantile(mut values: Vec<f32>, share: f32) -> Option<f32> {
    values.retain(|value| value.is_finite());
    let at = (values.len().checked_sub(1)? as f32 * share.clamp(0.0, 1.0)).round() as usize;
    Some(*values.select_nth_unstable_by(at, f32::total_cmp).1)
}

/// Stretches of frames for which a condition holds, as `start..end`.
pub fn stretches(count: usize, holds: impl Fn(usize) -> bool) -> Vec<std::ops::Range<usize>> {
    let mut found = vec![];
    let mut start = None;
    for frame in 0..=count {
        match (frame < count && holds(frame), start) {
            (true, None) => start = Some(frame),
            (false, Some(from)) => {
                found.push(from..frame);
                start = None;
            }
            _ => {}
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_keeps_constants_and_spreads_steps() {
        assert!(gaussian(&[2.0f32; 7], 3.0).iter().all(|v| (v - 2.0).abs() < 1e-6));
        let step: Vec<f32> = (0..40).map(|i| if i < 20 { 0.0 } else { 1.0 }).collect();
        let smooth = gaussian(&step, 2.0);
        assert!(smooth.windows(2).all(|w| w[1] >= w[0]));
        assert!((smooth[19] + smooth[20] - 1.0).abs() < 1e-5 && smooth[19] > 0.3);
        assert_eq!(gaussian(&[1.0f32, 5.0], 0.0), [1.0, 5.0]);
    }

    #[test]
    fn quantiles_and_stretches() {
        assert_eq!(quantile(vec![3.0, f32::NAN, 1.0, 2.0], 0.5), Some(2.0));
        assert_eq!(quantile(vec![], 0.5), None);
        let even = [true, true, false, true];
        assert_eq!(stretches(4, |i| even[i]), [0..2, 3..4]);
        assert!(stretches(0, |_| true).is_empty());
    }
}
