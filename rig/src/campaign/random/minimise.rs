//! The minimisation of a failing case, as far as it still fails.

use crate::campaign::drawn::Dimension;

/// Number of times that a value's remaining distance from its sound value is halved.
const HALVINGS: usize = 5;

/// The values that still fail although as few of them as possible differ from the sound ones, and by as little as possible.
pub fn minimise<E>(
    dimensions: &[Dimension],
    values: &[f64],
    fails: impl Fn(&[f64]) -> Result<bool, E>,
) -> Result<Vec<f64>, E> {
    let mut smallest = values.to_vec();
    let try_value = |smallest: &mut Vec<f64>, at: usize, value: f64| {
        let mut tried = smallest.clone();
        if let Some(slot) = tried.get_mut(at) {
            *slot = value;
        }
        let still = fails(&tried)?;
        if still {
            *smallest = tried;
        }
        Ok(still)
    };
    let odd: Vec<(usize, f64)> =
        (0..).zip(dimensions).filter_map(|(at, dimension)| Some((at, dimension.sound?))).collect();
    for (at, sound) in &odd {
        try_value(&mut smallest, *at, *sound)?;
    }
    for (at, sound) in odd {
        for _ in 0..HALVINGS {
            let value = smallest.get(at).copied().unwrap_or(sound);
            if value == sound || !try_value(&mut smallest, at, 0.5 * (value + sound))? {
                break;
            }
        }
    }
    Ok(smallest)
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn dimension(sound: Option<f64>) -> Dimension {
        Dimension { name: "", low: -1.0, high: 1.0, sound }
    }

    #[test]
    fn what_does_not_matter_becomes_sound_and_what_does_as_small_as_it_fails() {
        let dimensions = [dimension(Some(0.0)), dimension(None), dimension(Some(1.0))];
        let fails = |values: &[f64]| Ok::<_, ()>(values[0] > 0.2);
        let smallest = minimise(&dimensions, &[0.9, 0.5, -0.5], fails).unwrap();
        assert_eq!(smallest, [0.225, 0.5, 1.0]);
    }
}
