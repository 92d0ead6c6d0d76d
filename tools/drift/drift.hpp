/// \file
/// Drift against rebuild interval. From a state a window of substeps is run, and lists that are rebuilt
/// every N substeps with a skin are held to all pairs at every substep of it. Then the same lists are
/// timed, and followed to see how far they lead the fluid astray. Of a scene the whole pour is looked at.
#pragma once

#include "oracle/backend.hpp"
#include "oracle/lists/list_theory.hpp"
#include "oracle/lists/stale_list.hpp"
#include "oracle/solution/ensemble.hpp"
#include "oracle/solution/fixture.hpp"
#include "tools/drift/power_fit.hpp"

#include <array>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace decant::drift {

inline constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();

/// When a list is rebuilt, and how much further than H it reaches.
struct ListChoice {
  int interval = 1;      // substeps between rebuilds; 0: before a pair can be missed; −1: its owner's way
  double skin = 0;       // share of H; NaN for intervals below 1
  bool derived = false;  // the skin is the one that theory asks for (list_theory.hpp)

  std::string options() const;  // of the backend `list`
};

/// Which lists are held to all pairs, and for how long.
struct Plan {
  std::vector<ListChoice> lists;  // intervals >= 1
  bool chooses = true;            // false: the backend keeps its lists its own way, and is timed and followed so
  int window = 50;                // substeps
  bool timed = true;              // false: no list is run to be timed and followed
};

/// Every interval with every skin.
std::vector<ListChoice> all_lists(const std::vector<int>& intervals, const std::vector<double>& skins);

/// One list at one substep of the window.
struct Sample {
  ListChoice list;
  std::int64_t substep;  // of the window, or of the scene
  Staleness stale;
  bool proved;  // complete, by displacements
};

/// One list over the window, and what it costs.
struct Row {
  std::string fixture;
  ListChoice list;
  double missed_share = 0, worst_missed_share = 0;   // of the pairs within H; mean over the window, largest
  double wall_missed_share = 0;                      // mean, of the wall's pairs
  double deepest = 0;                                // largest (H − r)/H of a missed pair
  double wasted_share = 0;                           // of the listed pairs, not within H; mean
  double density_score = 0, acceleration_score = 0;  // largest over the window
  double density_rms = 0, pressure_rms = 0, acceleration_rms = 0, wall_acceleration_rms = 0;
  // Substeps after a rebuild at which a pair is first missed, and until which displacements prove that
  // none is; the earliest over the window's lists, the interval itself where there is none.
  int first_miss = 1, proved_until = 1;
  // What the backend's own lists miss in the same window, mean: as it counts itself (list:check_completeness=on), or
  // by the lists that it gives.
  double own_missed_share = not_measured, own_wall_missed_share = not_measured;
  ExpectedDrift expected;  // by theory, from the window's first state, at the list's last substep
  double substep_us = not_measured, rebuild_every = not_measured;
  double deviation = not_measured;                // RMS of positions after the ensemble's substeps / dx
  double deviation_over_ensemble = not_measured;  // and over the ensemble's mean
  double energy_drift = not_measured;             // J, beside lists that are complete
  double momentum_drift = not_measured;           // kg m/s, the same
};

/// Longest interval without a miss, by skin; the window's length stands for at least as much.
struct SafeInterval {
  std::string fixture;
  double skin;
  int measured;           // no list of the window missed a pair at a younger age
  int proved;             // nor could it have, by the displacements seen
  int expected;           // by the displacement bound, from the speeds of the window's first state
  int expected_relative;  // from how fast the pairs near H approach
};

/// What happened between the first and last frame of a pour by one list, beside complete lists.
struct WholePour {
  std::string fixture;
  ListChoice list;
  std::uint32_t perturbation = 0;    // not 0: complete lists, and a start perturbed by rounding
  std::string trouble;               // of the backend; the rest is then NaN
  std::array<double, 5> share_at{};  // of the mass, by Region, at the end
  std::int64_t inside = 0;           // particles seen inside a solid, largest count
  double kinetic_peak = not_measured, energy_lost = not_measured;  // J
  double energy_drift = not_measured;                              // RMS over the pour, over the energy lost
  double momentum_drift = not_measured;                            // RMS over the pour, over the RMS of the momentum
  // Share of the pairs within H that its lists lacked over the pour, counted on the device.
  double missed_share = not_measured, wall_missed_share = not_measured;
  double rebuild_every = not_measured;  // substeps
};

/// What was measured from one state.
struct Result {
  std::string fixture;
  double particle_spacing = 0, support_radius = 0;  // m
  std::int64_t particles = 0;
  std::vector<Sample> samples;
  std::vector<Row> rows;
  std::vector<SafeInterval> safe;
  /// Powers with which what a list without skin misses grows with how far neighbors moved against each
  /// other since the build: missed pairs, mean deficit of density, of acceleration. Beside them theory's.
  std::array<PowerFit, 3> powers;
  std::array<double, 3> edge_powers{};
  double measured_seconds = 0, run_seconds = 0;  // in all; of the backend's part
};

/// One list at one moment of a pour, at the last substep before it would be rebuilt.
struct PourMoment {
  double time;  // s
  Sample sample;
};

/// What was measured along one scene, and what became of whole pours of it.
struct PourResult {
  std::string fixture;
  std::vector<PourMoment> moments;
  std::vector<WholePour> whole;
};

/// Makes a backend with that list. \param counting  it counts what it misses, if it can
using ListMaker = std::function<std::unique_ptr<Backend>(const ListChoice& list, bool counting)>;

/// Lists that miss nothing, rebuilt when displacements ask for it.
inline const ListChoice complete_list{0, not_measured, false};
/// Lists as the backend keeps them.
inline const ListChoice own_list{-1, not_measured, false};

/// Throws BackendError where a backend reports trouble, as the functions below do.
void require_ok(const Backend& backend, const Status& status);

/// Means and worst of one list's samples.
Row summed_up(const std::string& fixture, const std::vector<Sample>& samples);

/// Measures one window. \param fixture  its recorded fields are not needed; \param progress  called now and then, from
/// one thread at a time, with the part that is done, 0 … 1
Result measure(const Fixture& fixture, const Plan& plan, const ListMaker& make_list,
               const std::function<void(double)>& progress = {});

/// Times every list from the fixture's state and follows it beside complete ones.
void time_and_follow(const Fixture& fixture, const Walls& walls, int window, const ListMaker& make_list,
                     Result& result);

/// The time of a substep of `backend`, and where it is after the ensemble's substeps beside `right`, run alike.
void time_beside(const Fixture& fixture, const Walls& walls, int window, Backend& backend, Backend& right, Row& row);

/// Of the window's pairs within H, those that the lists of a backend lack that gives them: both kinds, and the wall's.
std::array<double, 2> missed_of_given_lists(const Fixture& fixture, const Walls& walls, Backend& backend, int window);

/// A backend as it is, whose lists nobody chooses: from a window, what its lists lack or, where it does not give them,
/// how far its fields are from the oracle's at the same states; its time per substep; and where it is after the
/// ensemble's substeps beside the oracle. Row and samples are added to `result`.
void measure_as_it_is(const Fixture& fixture, int window, bool timed, Backend& backend, Result& result);

/// For each interval the smallest skin that theory expects to stay within the tolerance in every one of
/// these states, rounded up to 0.01.
std::vector<ListChoice> derived_lists(const std::vector<Fixture>& fixtures, const std::vector<int>& intervals,
                                      double tolerance);

/// Runs a scene with complete lists; at `samples` moments what each list would miss just before its rebuild,
/// and the state at each of `phases`.
PourResult along_pour(const Scene& scene, const Plan& plan, int samples, const ListMaker& make_list,
                      std::vector<Fixture>& phases);

/// Does one part of long work: calls what it is given, or never returns.
using DoPart = std::function<void(const std::function<void()>& part)>;

/// The whole pour by complete lists, by `perturbed` more whose start differs by rounding, and by each list.
/// They are added to `pours` one by one, each run a part of the work.
void whole_pours(const Scene& scene, const Plan& plan, int perturbed, const ListMaker& make_list, const DoPart& do_part,
                 std::vector<WholePour>& pours);

/// A run by another program: states, and the list that it used at each. Layout in
/// oracle/formats/list-series.md. Throws InputError.
Result measure_series(const Fixture& fixture, const std::filesystem::path& series);

/// The cheapest list whose acceleration stays within half of `tolerance` (relative RMS) at every substep of
/// every window measured: states between the measured ones may be worse. Null where none is.
struct Recommendation {
  ListChoice list;
  double worst_error, expected_error, substep_us, adaptive_us;
  double next_us = not_measured;  // of the list that errs least among the faster ones
  double next_error = not_measured;
};
std::unique_ptr<Recommendation> recommend(const std::vector<Result>& results, double tolerance);

/// Tables for people.
std::string table(const std::vector<Result>& results);
std::string pour_table(const std::vector<PourResult>& pours);

/// Layout in oracle/formats/drift.md. \param interrupted  how far the work came; empty: it is complete
void write(const std::filesystem::path& file, const std::vector<Result>& results, const std::vector<PourResult>& pours,
           const BackendInfo& backend, const std::string& interrupted = {});

}  // namespace decant::drift
