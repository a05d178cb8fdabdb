//! The rows of grids and lux-meters.

use super::*;

fn rows(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let head = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let rows = reader.records().map(|r| r.unwrap().iter().map(str::to_owned).collect()).collect();
    (head, rows)
}

#[test]
fn grid_rows_hold_place_numbers_and_note() {
    let dir = written(&plan(JOB), &merged(4));
    let (head, rows) = rows(&dir.path().join("desk.csv"));
    let header = "index,column,row,x_m,y_m,z_m,nx,ny,nz,direct_lx,illuminance_lx,standard_error_lx,\
                  ci_lower_lx,ci_upper_lx,family_lower_lx,family_upper_lx,vov,note";
    assert_eq!(head.join(","), header);
    assert_eq!(rows.len(), 6);
    // Scores of bin 0: 2, 0, 2, 0 and 10 lx that are the same in every batch.
    let se = (4.0f64 / (4.0 * 3.0)).sqrt();
    assert_eq!(rows[0][..11], ["0", "0", "0", "0.5", "0.8", "-0.5", "0.0", "1.0", "0.0", "10.25", "11.0"]);
    let numbers: Vec<f64> = [11, 12, 13, 16].iter().map(|&i| &rows[0][i]).map(|x| x.parse().unwrap()).collect();
    // Of two values in turn M4/M2^2 = 1/n, so that the variance of the variance is zero.
    for (read, expected) in numbers.iter().zip([se, 11.0 - T3 * se, 11.0 + T3 * se, 0.0]) {
        assert!(close(*read, expected), "{read} instead of {expected}");
    }
    assert_eq!(numbers[0], se, "every digit is printed");
    // One batch of four counts as one history of forty here, and has half of all.
    assert_eq!(rows[0][17], "few batches; peak");
    assert_eq!(rows[1][9..], ["NaN", "NaN", "NaN", "NaN", "NaN", "NaN", "NaN", "NaN", "inside"]);
    assert_eq!(rows[5][..6], ["5", "2", "1", "2.5", "0.8", "-1.5"]);
}

#[test]
fn grid_notes_say_no_information_and_incomplete() {
    let mut result = merged(20);
    let mut scores = Replicates::new(6);
    (0..20).for_each(|_| scores.accumulate(&[0.0; 6], &[0.0; 6]));
    result.sets[2] = SetResult::Replicates { scores: scores.into(), fixed_direct: vec![7.0; 6] };
    result.missing.push(20..24);
    let dir = written(&plan(JOB), &result);
    let (_, rows) = rows(&dir.path().join("desk.csv"));
    assert_eq!(rows[3][9..], ["7.0", "7.0", "NaN", "NaN", "NaN", "NaN", "NaN", "NaN", "no information; incomplete"]);
    let dir = written(&plan(JOB), &merged(0));
    let (_, rows) = self::rows(&dir.path().join("desk.csv"));
    assert_eq!(rows[0][9..], ["NaN", "NaN", "NaN", "NaN", "NaN", "NaN", "NaN", "NaN", "no information; few batches"]);
    assert_eq!(rows[1][17], "inside");
    let dir = written(&plan(JOB), &merged(1));
    let (_, rows) = self::rows(&dir.path().join("desk.csv"));
    assert_eq!(rows[0][9..], ["10.25", "12.0", "NaN", "NaN", "NaN", "NaN", "NaN", "NaN", "few batches; peak"]);
}

#[test]
fn grid_kept_as_moments_has_no_variance_of_variance() {
    let job = JOB.replace("rows = 2\n", "rows = 2\nkeep_batches = false\n");
    let mut result = merged(20);
    result.sets[2] = SetResult::Moments { bins: moments(6, 20, false).into(), fixed_direct: vec![1.0; 6] };
    let dir = written(&plan(&job), &result);
    let (_, rows) = rows(&dir.path().join("desk.csv"));
    assert_eq!([&rows[0][9], &rows[0][10], &rows[0][16], &rows[0][17]], ["1.25", "2.0", "NaN", ""]);
}

#[test]
fn points_share_one_table_with_their_names() {
    let dir = written(&plan(JOB), &merged(20));
    let (head, rows) = rows(&dir.path().join("points.csv"));
    assert_eq!(head[..4], ["name", "index", "column", "row"]);
    assert_eq!(rows.len(), 1);
    let place = ["meter", "0", "0", "0", "0.1", "0.2", "0.3", "0.0", "0.6000000000000001", "0.8", "0.25", "1.0"];
    assert_eq!(rows[0][..12], place);
    // 1 +- 0.23 lx.
    assert_eq!(rows[0][16], "relative error");
}
