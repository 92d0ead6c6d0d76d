/// \file
/// What a validation case is: a scene, lengths that count its resolution, an observer that turns the
/// run into quantities and curves, and gates that are never moved to make a case pass.
#pragma once

#include "oracle/backend.hpp"
#include "oracle/report/report.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace decant::validate {

/// One figure of a case. Where there is an allowance the verdict hangs on error <= allowance; a NaN
/// fails.
struct Quantity {
  std::string name, unit;                                       // unit of reference and result
  double reference = std::numeric_limits<double>::quiet_NaN();  // NaN: there is none
  double result = std::numeric_limits<double>::quiet_NaN();
  double error = std::numeric_limits<double>::quiet_NaN();      // a share, unless the name says else
  double allowance = std::numeric_limits<double>::quiet_NaN();  // NaN: reported, not gated

  bool gated() const { return !std::isnan(allowance); }
  bool met() const { return !gated() || error <= allowance; }
};

/// y over x, simulated or from a reference.
struct NamedCurve {
  std::string panel;  // curves of one panel are drawn over each other
  std::string name;
  std::string x_name, x_unit, y_name, y_unit;
  bool reference = false;
  std::vector<double> x, y;
};

/// One case at one resolution.
struct Result {
  std::string name;             // of the case
  std::string source;           // who says what is right
  int resolution = 0;           // particles along the case's length
  double particle_spacing = 0;  // m
  std::int64_t particles = 0, wall_particles = 0, substeps = 0;
  double simulated_seconds = 0, solver_seconds = 0;
  BackendInfo backend;
  std::vector<Quantity> quantities;
  std::vector<NamedCurve> curves;

  bool passed() const;
  Quantity& add(Quantity quantity);
};

/// A run at one instant. Fields are the backend's own.
struct Moment {
  double time;  // s
  const ParticleState& state;
  const Fields& fields;
};

/// Looks at every frame, the first one included, and tells in the end.
class Observer {
 public:
  virtual ~Observer() = default;
  virtual void sample(const Moment& moment) = 0;
  virtual void finish(Result& result) = 0;
};

/// What an observer may ask about the run it watches.
struct Inputs {
  const Scene& scene;
  const Walls& walls;
  int resolution;
  bool single_precision;              // the backend's
  std::filesystem::path experiments;  // folder of measured curves
};

/// A flow whose solution or measurement is known.
struct Case {
  std::string name, title, source;
  std::string scene;  // file in the folder of scenes
  double length;      // m; dx = length / resolution
  std::vector<int> resolutions;
  int affordable;  // the finest that a host executor runs unasked
  int quick;       // the one that --quick runs; 0: left out
  std::function<std::unique_ptr<Observer>(const Inputs&)> observe;
};

/// All cases, in the order they are run.
const std::vector<Case>& cases();

/// The case's scene at a resolution, substeps derived anew. Throws InputError as load_scene does, and where
/// the scene does not hold at that spacing.
Scene scene_of(const Case& which, int resolution, const std::filesystem::path& scenes);

/// Runs a case and asks its observer. Throws BackendError where the backend reports trouble.
/// \param scene  the case's at this resolution; \param experiments  folder of measured curves
/// \param frame_done  called with the number of frames done; may be empty
Result run(const Case& which, int resolution, const Scene& scene, Backend& backend,
           const std::filesystem::path& experiments, const std::function<void(int)>& frame_done = {});

/// Observed orders of convergence: for every gated or reported error of a case that ran at several
/// resolutions, log(e_coarse/e_fine) / log(n_fine/n_coarse) between neighbors, n the resolution.
struct ObservedOrder {
  std::string name, quantity;
  int coarse, fine;
  double order;
};
std::vector<ObservedOrder> observed_orders(const std::vector<Result>& results);

/// Case, quantity, reference, result, error, allowance, verdict.
std::string table(const std::vector<Result>& results);

/// Everything that was found, with curves; layout in oracle/formats/validation.md. Appears whole or not at
/// all.
/// \param interrupted  how far the work came; empty: it is complete
void write(const std::filesystem::path& file, const std::vector<Result>& results, const std::string& interrupted = {});

}  // namespace decant::validate
