#pragma once
// Figures published in the paper (Wang et al., Appl. Sci. 2024, 14, 9824), in millimetres.

namespace cellcal::sim::paper {

struct PublishedFigures {
  double before_mean_mm, before_max_mm;
  double after_mean_mm, after_max_mm;
};

/// Section 4.3 and Figure 8: simulation without noise, the 50 touches of the fit.
inline constexpr PublishedFigures kPublishedSimulation{3.657, 5.559, 0.665, 1.104};
/// Section 5.4 and Figure 11: the real robot, 30 touches not used for the fit.
inline constexpr PublishedFigures kPublishedExperiment{1.923, 4.715, 0.383, 1.153};
/// Section 4.2: "After 50 iterations, the data converged".
inline constexpr int kPublishedIterations = 50;
/// Section 5.4: c_t identified on the real robot, 1/(N m^2).
inline constexpr double kPublishedDeflection = 0.00036;

}  // namespace cellcal::sim::paper
