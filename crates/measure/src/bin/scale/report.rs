//! A stand-in for the report of the binary.

pub struct Report {
    pub quick: bool,
}

impl Report {
    pub fn row(&mut self, case: &str, what: &str, size: usize, seconds: f64, bytes: Option<usize>) {
        println!("{case:>10}  {what:<60} {size:>9}  {seconds:11.4e} s  {bytes:?}");
    }
    pub fn verdict(&mut self, case: &str, what: &str, figure: f64, bound: f64) {
        println!(
            "{case:>10}  {}  {figure:10.3e} <= {bound:<10.3e} {what}",
            if figure <= bound { "pass" } else { "FAIL" }
        );
    }
}
