//! Figures of motions. None is proven to mean "looks natural".

/// How well joint angles repeat themselves, and the period in seconds: the highest peak of the
/// autocorrelation of all series together, from 0.1 s to 4 s. 1 is exact; none if nothing moves.
pub(crate) fn regularity(series: &[Vec<f32>], dt: f32) -> (Option<f64>, Option<f64>) {
    let length = series.first().map_or(0, Vec::len);
    let (first, last) = ((0.1 / dt) as usize, ((4.0 / dt) as usize).min(length / 2));
    let centred: Vec<Vec<f64>> = series
        .iter()
        .map(|values| {
            let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / length.max(1) as f64;
            values.iter().map(|&v| f64::from(v) - mean).collect()
        })
        .collect();
    // Normalised over the two stretches that are compared, so that it is at most 1.
    let correlation = |lag: usize| {
        let (mut product, mut power) = (0.0, [0.0; 2]);
        for values in &centred {
            for (a, b) in values.iter().zip(&values[lag..]) {
                product += a * b;
                power[0] += a * a;
                power[1] += b * b;
            }
        }
        let power = (power[0] * power[1]).sqrt();
        if power > 1e-9 { product / power } else { 0.0 }
    };
    if last <= first + 2 {
        return (None, None);
    }
    let all: Vec<f64> = (first..last).map(correlation).collect();
    let peaks = (1..all.len() - 1).filter(|&i| all[i] > all[i - 1] && all[i] >= all[i + 1]);
    let peaks: Vec<usize> = peaks.filter(|&i| all[i] > 0.0).collect();
    let Some(most) = peaks.iter().map(|&i| all[i]).max_by(f64::total_cmp) else {
        return (None, None);
    };
    // The shortest lag that is about as good: a period, not a multiple of it.
    let at = peaks.into_iter().find(|&i| all[i] >= most - 0.03).expect("the highest is one");
    (Some(most), Some((first + at) as f64 * f64::from(dt)))
}

/// 1 − mean|qL(t) − qR(t + T/2)| / range, mean of the pairs; none without pairs or period.
pub(crate) fn symmetry(
    series: &[Vec<f32>],
    pairs: &[[usize; 2]],
    period: Option<f64>,
    dt: f32,
) -> Option<f64> {
    let half = (0.5 * period? / f64::from(dt)).round() as usize;
    let of_pair = |&[left, right]: &[usize; 2]| {
        let (left, right) = (&series[left], &series[right]);
        let all = || left.iter().chain(right).copied();
        let range = all().fold(f32::NEG_INFINITY, f32::max) - all().fold(f32::INFINITY, f32::min);
        let shifted = left.iter().zip(right.iter().skip(half));
        let (sum, count) =
            shifted.fold((0.0, 0u32), |(s, n), (l, r)| (s + f64::from((l - r).abs()), n + 1));
        if range < 1e-6 || count == 0 {
            return 0.0;
        }
        (1.0 - sum / f64::from(count) / f64::from(range)).max(0.0)
    };
    if pairs.is_empty() {
        return None;
    }
    Some(pairs.iter().map(of_pair).sum::<f64>() / pairs.len() as f64)
}

/// Spectral arc length (Balasubramanian et al., "On the analysis of movement smoothness", 2015) of
/// a speed over time: nearer to 0 is smoother. Up to 10 Hz, and down to 5 % of the largest part.
pub(crate) fn spectral_arc_length(speeds: &[f32], dt: f32) -> Option<f64> {
    const HIGHEST: f64 = 10.0;
    const LEAST: f64 = 0.05;
    let length = speeds.len();
    if length < 8 {
        return None;
    }
    // Four times as fine as the length gives, as zero padding would.
    let step = 1.0 / (4.0 * length as f64 * f64::from(dt));
    let bins = (HIGHEST / step) as usize + 1;
    let magnitude = |bin: usize| {
        let turn = std::f64::consts::TAU * bin as f64 * step * f64::from(dt);
        let (s, c) = libm::sincos(turn);
        let (mut re, mut im, mut x, mut y) = (0.0, 0.0, 1.0, 0.0);
        for &speed in speeds {
            re += f64::from(speed) * x;
            im -= f64::from(speed) * y;
            (x, y) = (x * c - y * s, x * s + y * c);
        }
        (re * re + im * im).sqrt()
    };
    let mut spectrum: Vec<f64> = (0..bins).map(magnitude).collect();
    let most = spectrum.iter().copied().fold(0.0, f64::max);
    if most <= 0.0 {
        return None;
    }
    spectrum.iter_mut().for_each(|value| *value /= most);
    let last = spectrum.iter().rposition(|&value| value >= LEAST)?;
    let width = 1.0 / last.max(1) as f64;
    let arcs = spectrum[..=last].windows(2).map(|w| (width * width + (w[1] - w[0]).powi(2)).sqrt());
    Some(-arcs.sum::<f64>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    fn wave(period: f32, shift: f32, steps: usize) -> Vec<f32> {
        (0..steps).map(|t| (TAU * (t as f32 / 60.0 / period + shift)).sin()).collect()
    }

    #[test]
    fn a_wave_is_regular_with_its_period_and_noise_is_not() {
        let (regular, period) = regularity(&[wave(0.5, 0.0, 600), wave(0.5, 0.3, 600)], 1.0 / 60.0);
        assert!(regular.unwrap() > 0.99 && (period.unwrap() - 0.5).abs() < 0.01);
        let mut state = 1u32;
        let noise = (0..600).map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        });
        assert!(regularity(&[noise.collect()], 1.0 / 60.0).0.unwrap() < 0.4);
        assert_eq!(regularity(&[vec![0.3; 600]], 1.0 / 60.0), (None, None));
    }

    #[test]
    fn opposite_pairs_are_symmetric() {
        let pair = |shift| [wave(1.0, 0.0, 600), wave(1.0, shift, 600)];
        let of = |shift| symmetry(&pair(shift), &[[0, 1]], Some(1.0), 1.0 / 60.0).unwrap();
        assert!(of(0.5) > 0.99 && of(0.0) < 0.5, "{} {}", of(0.5), of(0.0));
        assert_eq!(symmetry(&pair(0.5), &[], Some(1.0), 1.0 / 60.0), None);
    }

    #[test]
    fn jerky_is_less_smooth() {
        let smooth: Vec<f32> = (0..300).map(|t| 1.0 - (TAU * t as f32 / 300.0).cos()).collect();
        let jerky: Vec<f32> = (0..300).map(|t| if t / 10 % 2 == 0 { 1.5 } else { 0.1 }).collect();
        let of = |speeds: &[f32]| spectral_arc_length(speeds, 1.0 / 60.0).unwrap();
        assert!(
            of(&smooth) > -2.0 && of(&jerky) < of(&smooth) - 0.5,
            "{} {}",
            of(&smooth),
            of(&jerky)
        );
    }
}
