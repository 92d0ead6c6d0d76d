/// \file
/// What a conformance run leaves behind: flat columns under /summary, the arrays behind each
/// failing check, where it all came from; and the console table. The file's layout is in
/// formats/report.md.
#pragma once

#include "oracle/backend.hpp"

#include <Eigen/Dense>

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace decant {

enum class Verdict : std::uint8_t { pass, fail, not_run };
/// "pass", "fail" or "not_run".
const char* to_string(Verdict verdict);

/// Reason of a row about something that a backend does not offer: its other rows decide.
inline constexpr const char* not_offered = "not offered";

inline constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

/// One line of /summary: one field of one check of one backend on one fixture.
struct CheckRow {
  std::string backend, options, executor, device;
  std::string fixture;
  std::string check;  // "neighbors", "boundary_volume", "density", …
  std::string field;
  std::string unit;
  std::int64_t n = 0;    // values compared
  double error = 0;      // largest |error|, in `unit`
  double tolerance = 0;  // that value's own tolerance
  double score = 0;      // max |error| / tolerance; passes where score <= 1
  double median_score = 0;
  double fp32_reference_score = 0;    // score of the oracle's source in sequential fp32; NaN where none
  std::int64_t worst_id = -1;         // a wall particle's where the field is boundary_volume
  std::int64_t worst_component = -1;  // 0, 1, 2 of a vector; of a tensor the reason says it
  /// The worst value and the oracle's, in `unit`; `expected` is no number where a row has none.
  double actual = no_number, expected = no_number;
  /// Where the worst particle is in the fixture, m, and who is nearer than H: filled by `locate`
  /// (neighborhood.hpp) for rows that fail at a particle.
  double worst_x = no_number, worst_y = no_number, worst_z = no_number;
  std::int64_t fluid_neighbors = -1, wall_neighbors = -1;
  std::string nearest;        // ids of the eight nearest fluid neighbors at most, nearest first
  std::int64_t excluded = 0;  // ambiguous particles left out, by name and within a bound
  Verdict verdict = Verdict::not_run;
  std::string reason;  // why not_run or fail; empty on a pass
  /// Per-particle |error| and tolerance (N, or 3N by component); kept whole for a failing check, as
  /// quantiles of the score for a passing one.
  Eigen::VectorXd errors, tolerances;
  /// Score that `quantile_percent` % of the values do not exceed; empty until `condense`.
  std::vector<double> score_quantiles;
};

/// Whether the row is about something that its backend does not offer.
inline bool is_left_out(const CheckRow& row) { return row.verdict == Verdict::not_run && row.reason == not_offered; }

inline constexpr std::array<int, 9> quantile_percent = {0, 1, 5, 25, 50, 75, 95, 99, 100};

/// Fills the row's score quantiles from its arrays, and drops the arrays where the row passes, so
/// that a long run does not hold what no report will keep.
void condense(CheckRow& row);

/// Fluid and wall particles around the worst particle of one row, as points to look at.
struct Neighborhood {
  std::int64_t row = -1;                              // in the summary
  double spacing = 0, support_radius = 0;             // m
  Eigen::Matrix3Xd position;                          // 3×P, m, fluid first
  Eigen::Matrix<std::int64_t, Eigen::Dynamic, 1> id;  // P, of the fluid or of the walls
  std::vector<std::uint8_t> wall;                     // P, 1 for wall particles
  Eigen::VectorXd density;                            // P, the oracle's, kg/m³; no number for walls
  /// P, of the row's field, where a vector's component scores most; no number where none.
  Eigen::VectorXd error, tolerance, score;
};

struct Report {
  std::vector<CheckRow> rows;
  std::map<std::string, std::string> provenance;
  std::optional<Neighborhood> neighborhood = std::nullopt;
};

/// The verdict as every consumer must read it: a pass stands only where 0 <= score <= 1 and value
/// and tolerance are numbers, otherwise it is a fail.
Verdict verdict_of(const CheckRow& row);

/// The row's reason, or why its verdict of pass does not stand.
std::string reason_of(const CheckRow& row);

/// Whether the row has its per-particle errors and their tolerances.
bool has_arrays(const CheckRow& row);

/// Error over tolerance; a tolerance of 0 asks for equality; infinite where either is no number.
double score_of(double error, double tolerance);

/// score_of each value's |error|.
Eigen::VectorXd scores_of(const CheckRow& row);

/// Nearest-rank quantiles of the scores, of quantile_percent; what the row already has, or NaN, where it has no
/// arrays.
std::vector<double> quantiles_of(const CheckRow& row);

/// 0 all pass; 1 something fails; 3 something asked for could not run (and nothing fails), or the
/// report is empty.
int exit_status(const Report& report);

}  // namespace decant
