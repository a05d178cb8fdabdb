//! Lampyris: global illumination in absolute photometric units, every number with a confidence interval.
//!
//! # The equation
//!
//! The unknown is the luminance L(y, w) \[cd/m2\] at a surface point y in the direction w:
//!
//! ```text
//! L(y,w) = L0(y,w) + int f(y; w' -> w) |(N_y,w')| L_in(y,w') dw'             L = L0 + K L = sum_n K^n L0
//! ```
//!
//! L0 is what the surface emits, f \[1/sr\] how it reflects; K^n L0 is light reflected n times. Histories leave the
//! sources and make chains of vertices x_1, x_2, ... with weights W_n, the flux that arrives there \[lm\]. From every
//! vertex a connection goes to every receiver r; u_n is the direction from x_n to r, and G = |cos| |cos| V / d^2 the
//! geometric factor with the visibility V:
//!
//! ```text
//! E(r)   = E_0(r)   + E[ sum_n W_n f(x_n; w_n -> u_n) G(x_n,r) ]                  local estimation: illuminance [lx]
//! L(r,l) = L0 + K L0 + E[ sum_n W_n f(x_n; w_n -> u_n) G(x_n,r) f(r; u_n -> l) ]  double local estimation: luminance
//! ```
//!
//! These are one estimator with two responses of the receiver. No image, mesh of patches or map stands between the
//! histories and the value at a point. The method is that of Budak, Zheltov and Kalakutsky; docs/method.md states it
//! with its proofs, corrects it, and says where every equation of the paper lives.
//!
//! # Notation
//!
//! | code | here | meaning |
//! |---|---|---|
//! | history, trajectory, vertex | x_n | one particle from a source; its chain; one surface point on it |
//! | `weight` | W_n | flux that arrives at vertex n \[lm\] |
//! | `w_in`, `w_out` | w, l | directions in which light travels |
//! | `evaluate` | f | law of reflection \[1/sr\]; f = sigma/pi |
//! | `factor` | G | geometric factor with visibility \[1/m2\] |
//! | receiver | r | point, normal and response: a pixel, a direction of a goniometer, a lux-meter |
//! | batch | | a fixed number of histories: one realization, the unit of the variance |
//! | shard | | a range of batches, the unit of work; its state is a checkpoint |
//!
//! # The flow
//!
//! ```text
//! job file -> Job -> Plan -> shard -> trajectories -> Scores -> Tally -> checkpoint -> merge -> EXR, CSV, PNG, summary
//! ```
//!
//! # The layers
//!
//! A module imports from lower layers only, or from its own folder (`tests/layers.rs` checks it). They are declared
//! below in this order, bottom first.
//!
//! | layer | modules | what | must never know |
//! |---|---|---|---|
//! | 0 | [`error`] | one error type, and its exit codes | |
//! | 1 | [`math`] | the only door to transcendental functions | |
//! | 2 | [`random`], [`photometry`] | (seed, domain, index) to generator, quasi-random points; colours | files, histories |
//! | 3 | [`job`] | the job file, every value checked | scenes, threads |
//! | 3 | [`geometry`] | closest hit, mutual visibility | light, reflectance, pixels |
//! | 4 | [`tally`] | scores of a batch, moments, statistics | what it counts, and where |
//! | 4 | [`scene`] | surfaces, sources, skies, photometric webs, laws of reflection, glTF | receivers, seeds |
//! | 5 | [`transport`] | the equations: trajectories, direct light, connections | files, threads, shards, pictures |
//! | 6 | [`farm`] | plan, worker processes, checkpoints, merge, engines for many machines | files of results |
//! | 7 | [`report`] | EXR, CSV, PNG, JSON | how the numbers were made |
//! | 8 | [`fit`] | spherical harmonics fitted to a mesh, and their errors | light, jobs, histories |
//! | 8 | [`validate`] | cases with an exact answer, run and judged | files, printing |
//!
//! The binary (`main`, `cli`, `commands`) joins farm and report. Reading order for the physics: [`transport`], then
//! [`transport::trajectory`], [`transport::connection`], [`transport::direct`], [`scene`]; for the statistics
//! [`tally`]; for what happens when something dies [`farm`].

pub mod error;
pub mod math;

pub mod photometry;
pub mod random;

pub mod geometry;
pub mod job;

pub mod scene;
pub mod tally;

pub mod transport;

pub mod farm;

pub mod report;

pub mod fit;
pub mod validate;
