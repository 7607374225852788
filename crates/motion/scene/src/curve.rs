//! Weights over time.

/// The weight at a time, from keys `[time, value]` whose times rise.
///
/// Between two keys it eases: flat at both, so that a weight begins and ends without a jerk and never
/// leaves the range of its keys. Before the first key and after the last it stays. 0 without keys.
pub fn weight(keys: &[[f32; 2]], time: f32) -> f32 {
    let next = keys.partition_point(|key| key[0] <= time);
    match (next.checked_sub(1).map(|i| keys[i]), keys.get(next)) {
        (Some([start, from]), Some(&[end, to])) => {
            let t = ((time - start) / (end - start)).clamp(0.0, 1.0);
            let value = from + (to - from) * ease(t);
            // Rounding must not leave the range; NaN, which no file has, passes.
            value.min(from.max(to)).max(from.min(to))
        }
        (Some([_, last]), None) => last,
        (None, Some(&[_, first])) => first,
        (None, None) => 0.0,
    }
}

/// From 0 to 1 as `t` goes from 0 to 1, flat at both.
pub(crate) fn ease(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_passes_its_keys_and_eases_between_them() {
        let keys = [[0.5, 0.0], [1.0, 1.0], [2.0, 1.0], [2.5, 0.2]];
        for [time, value] in keys {
            assert_eq!(weight(&keys, time), value);
        }
        assert_eq!(weight(&keys, 0.75), 0.5);
        assert_eq!(weight(&keys, 1.5), 1.0);
        assert_eq!((weight(&keys, 0.0), weight(&keys, 9.0)), (0.0, 0.2));
        assert_eq!(weight(&[], 1.0), 0.0);
        // Flat at its keys: a hundredth of the way there is hardly any change.
        assert!(weight(&keys, 0.505) < 4e-4);
    }
}
