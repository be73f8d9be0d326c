//! Axes by value.

use super::*;

#[test]
fn axes_and_tables() {
    let (rows, columns) = (Axis::new(-3.0, 5.0, 5), Axis::new(0.0, 0.5, 3));
    assert_eq!((rows.first, rows.inverse_step, rows.count), (-3.0, 0.5, 5));
    assert_eq!((columns.first, columns.inverse_step, columns.count), (0.0, 4.0, 3));
    let made = grid(rows, columns, vec![[1.0]; 15]);
    assert_eq!((made.first_row, made.inverse_row_step, made.rows), (-3.0, 0.5, 5));
    assert_eq!((made.first_column, made.inverse_column_step, made.columns), (0.0, 4.0, 3));
    assert_eq!(made.nodes, [[1.0]; 15]);
    let made = curve(rows, vec![[2.0, 3.0]; 5]);
    assert_eq!((made.first, made.inverse_step, made.nodes), (-3.0, 0.5, &[[2.0, 3.0]; 5][..]));
}
