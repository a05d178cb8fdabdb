//! How light moves: the equations of the paper, as corrected in docs/method.md.
//!
//! The unknown is the luminance L(y, w) \[cd/m2\] of the global illumination equation
//!
//! ```text
//! L(y,w) = L0(y,w) + int f(y; w' -> w) |(N_y,w')| L_in(y,w') dw'        L = L0 + K L = sum_n K^n L0       paper (1), (4)
//! ```
//!
//! A *trajectory* is a Markov chain of surface points x_1, x_2, ... with weights W_n, the flux arriving at x_n:
//!
//! ```text
//! W_{n+1} = W_n f(x_n; w_n -> w_{n+1}) |(N,w_{n+1})| / pdf(w_{n+1}) / P_survive                              paper (5)
//! ```
//!
//! *Local estimation* gives the illuminance of a receiver r from every vertex (source vertex excluded), and *double
//! local estimation* the luminance of r in the direction l. With u_n from x_n to r and G = |cos| |cos| V / d^2:
//!
//! ```text
//! E(r)   = E_0(r)   + E[ sum_n W_n f(x_n; w_n -> u_n) G(x_n, r) ]                                             paper (5)
//! L(r,l) = L0 + K L0 + E[ sum_n W_n f(x_n; w_n -> u_n) G(x_n, r) f(r; u_n -> l) ]                             paper (9)-(12)
//! ```
//!
//! They are one estimator with two responses of the receiver: 1 for illuminance (the cosine stands in G), f(r; u -> l)
//! for luminance. E_0 and K L0 are direct light and never come from vertices; L0 is added once for each receiver ray.
//!
//! | order (reflections) | illuminance E(r) | luminance L(r,l) |
//! |---|---|---|
//! | 0 | E_0: source -> r | L0: emission of the seen surface |
//! | 1 | vertex x_1 | K L0: source -> r -> eye |
//! | n | vertex x_n | vertex x_(n-1) |
//!
//! | code | paper | meaning |
//! |---|---|---|
//! | `sigma` | sigma | pi f, for a Lambert surface the reflectance rho |
//! | `weight` | Q_n | W_n, flux arriving at vertex n \[lm\] |
//! | `factor` | F Theta | geometric factor G with visibility \[1/m2\] |
//! | `w_in`, `w_out` | l, l' | propagation directions of light |
//!
//! Transport does not know files, threads, shards, how many histories run, nor the shape of a picture.

mod aimed;
mod bodies;
pub mod connection;
mod connectors;
pub mod continuation;
pub mod crossing;
pub mod direct;
pub mod eye;
pub mod lamps;
pub mod neighbours;
pub mod pool;
mod projected_cap;
pub mod receiver;
pub mod reverse;
pub mod shared;
pub mod sky;
mod spherical_triangle;
mod totals;
pub mod trajectory;
mod varying;
mod veils;
