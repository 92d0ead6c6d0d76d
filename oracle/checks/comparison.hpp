/// \file
/// One field of a backend against the oracle's, value by value, and the rows that checks are made of.
/// Every comparison is written so that NaN fails.
#pragma once

#include "oracle/report/report.hpp"
#include "oracle/solution/fixture.hpp"

#include <Eigen/Dense>

#include <limits>
#include <string>
#include <vector>

namespace decant {

/// Values of one field, particle by particle, `components` a particle.
struct Values {
  Eigen::VectorXd actual, expected, tolerance;
  Eigen::VectorXd fp32_value;  // empty: no fp32 counterpart
  int components = 1;
  const std::vector<bool>* excluded = nullptr;
  std::int64_t most_excluded = 0;
  // What an excluded value must keep all the same: sane, if not precise.
  double excluded_least = -std::numeric_limits<double>::infinity();
  double excluded_tolerance = std::numeric_limits<double>::infinity();
};

/// Column by column.
template <class Matrix>
Eigen::VectorXd flat(const Matrix& m) {
  return Eigen::Map<const Eigen::Matrix<typename Matrix::Scalar, Eigen::Dynamic, 1>>(m.data(), m.size())
      .template cast<double>();
}

/// Fills the row's figures, arrays, verdict and reason.
void compare(const Values& v, CheckRow& row);

/// The same of one number; `worst_id` may name a particle.
void compare(double error, double tolerance, CheckRow& row, std::int64_t worst_id = -1);

/// Rows of one backend on one fixture, in order.
class RowBuilder {
 public:
  RowBuilder(const BackendInfo& info, const std::string& fixture);

  CheckRow& row(const char* check, const std::string& field, const char* unit);
  /// A check of which nothing could be compared.
  void failed(const char* check, const std::string& why);
  /// A check that was left out.
  void not_run(const char* check, const std::string& why);
  std::vector<CheckRow> take() { return std::move(rows_); }

 private:
  CheckRow common_;
  std::vector<CheckRow> rows_;
};

}  // namespace decant
