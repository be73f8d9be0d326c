//! Values that change in steps.

/// The value that holds at a time, each from its time (s) on; `None` before the first one.
pub fn held<T: Copy>(steps: &[(f64, T)], t_s: f64) -> Option<T> {
    let after = steps.partition_point(|(at_s, _)| *at_s <= t_s + 1e-9);
    after.checked_sub(1).and_then(|last| steps.get(last)).map(|(_, value)| *value)
}

#[cfg(test)]
mod tests {
    use super::held;

    #[test]
    fn a_value_holds_from_its_time_until_the_next_one() {
        let steps = [(0.1, 'a'), (0.2, 'b')];
        assert_eq!(
            [0.0, 0.1, 0.15, 0.2, 9.0].map(|t_s| held(&steps, t_s)),
            [None, Some('a'), Some('a'), Some('b'), Some('b')]
        );
        assert_eq!(held::<char>(&[], 0.0), None);
    }
}
