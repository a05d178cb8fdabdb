//! Reference tables that are part of the program: values of closed forms, and of quadratures for what has none
//! (30 digits for Sobolev's problem, about 1e-4 for the cube).

use std::collections::HashMap;

/// Cases of physics with an analytic answer: case, parameters, quantity, value.
pub const ANALYTIC: &str = include_str!("reference/analytic_cases.csv");
/// Illuminances of Sobolev's problem: case, h1, h2, rho1, rho2, r, E1, E2 and their direct parts.
pub const SOBOLEV: &str = include_str!("reference/sobolev_tables.csv");
/// The same order by order: case, plane, r, order, E_order.
pub const SOBOLEV_ORDERS: &str = include_str!("reference/sobolev_orders.csv");
/// Standard deviations of one trajectory: case, estimator, r, ...
pub const SOBOLEV_DEVIATIONS: &str = include_str!("reference/sobolev_le_sd.csv");

/// A row as a map from column to text.
pub type Row = HashMap<String, String>;

/// Rows of a table.
pub fn rows(table: &str) -> Vec<Row> {
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    reader.deserialize().map(|row| row.expect("the tables of the program are well formed")).collect()
}

/// The number in a column of a row.
pub fn number(row: &Row, column: &str) -> f64 {
    row[column].parse().expect("the column holds numbers")
}

/// The value of a row of [`ANALYTIC`].
pub fn analytic(case: &str, parameters: &str, quantity: &str) -> f64 {
    let rows = rows(ANALYTIC);
    let is_it = |r: &&Row| r["case"] == case && r["parameters"] == parameters && r["quantity"] == quantity;
    let row = rows.iter().find(is_it).unwrap_or_else(|| panic!("no row {case}, {parameters}, {quantity}"));
    number(row, "value")
}
