/// \file
/// What the cases gave, as a table and as HDF5.
#include "oracle/files/hdf5_io.hpp"
#include "tools/common/build_provenance.hpp"
#include "tools/validation/validation.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace decant::validate {
namespace {

/// Columns that a text takes on a screen: bytes that continue a character take none.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::string padded(const std::string& text, std::size_t width) {
  const std::size_t is = width_of(text);
  return is < width ? text + std::string(width - is, ' ') : text;
}

std::string number(double value) { return std::isnan(value) ? "-" : fmt::format("{:.4g}", value); }

std::string share(double value) {
  if (std::isnan(value)) return "-";
  return value < 1e-4 ? fmt::format("{:.1e}", value) : fmt::format("{:.2f} %", 100 * value);
}

const char* verdict_of(const Quantity& quantity) {
  return !quantity.gated() ? "reported" : quantity.met() ? "pass" : "fail";
}

}  // namespace

std::string table(const std::vector<Result>& results) {
  std::size_t wide = 20;
  for (const auto& result : results)
    for (const auto& quantity : result.quantities)
      wide = std::max(wide, width_of(quantity.name) + width_of(quantity.unit) + 3);
  std::string text = fmt::format("{} {:>10} {:>10} {:>9} {:>9}  {}\n", padded("case, quantity", wide + 2), "reference",
                                 "result", "error", "allowed", "verdict");
  for (const auto& result : results) {
    const std::string label = result.backend.name +
                              (result.backend.options.empty() ? "" : ":" + result.backend.options) + " " +
                              result.backend.executor;
    text += fmt::format("{}/{}  {} particles, dx {:.4g} m, {} substeps, {:.1f} s, {}\n", result.name, result.resolution,
                        result.particles, result.particle_spacing, result.substeps, result.solver_seconds, label);
    for (const auto& quantity : result.quantities) {
      const std::string unit = quantity.unit == "1" ? "" : " [" + quantity.unit + "]";
      text += fmt::format("  {} {:>10} {:>10} {:>9} {:>9}  {}\n", padded(quantity.name + unit, wide),
                          number(quantity.reference), number(quantity.result), share(quantity.error),
                          share(quantity.allowance), verdict_of(quantity));
    }
  }
  const auto orders = observed_orders(results);
  if (!orders.empty()) {
    text += "\nobserved order of convergence\n";
    for (const auto& order : orders)
      text += fmt::format("  {} {:>3} to {:>3} {:>7.2f}\n", padded(order.name + ": " + order.quantity, wide + 16),
                          order.coarse, order.fine, order.order);
  }
  return text;
}

void write(const std::filesystem::path& file, const std::vector<Result>& results, const std::string& interrupted) {
  Hdf5Writer out(file);
  out.attribute("/", "decant_validation", 1);
  for (const auto& [key, value] : build_provenance()) out.attribute("/provenance", key, value);
  if (!interrupted.empty()) out.attribute("/provenance", "interrupted", interrupted);

  const auto column = [](const auto& rows, auto get) {
    std::vector<std::string> values;
    for (const auto& row : rows) values.push_back(get(row));
    return values;
  };
  const auto reals = [](const auto& rows, auto get) {
    Eigen::VectorXd values(static_cast<Eigen::Index>(rows.size()));
    for (std::size_t k = 0; k < rows.size(); ++k) values[static_cast<Eigen::Index>(k)] = get(rows[k]);
    return values;
  };
  const auto whole = [](const auto& rows, auto get) {
    IdVector values(static_cast<Eigen::Index>(rows.size()));
    for (std::size_t k = 0; k < rows.size(); ++k) values[static_cast<Eigen::Index>(k)] = get(rows[k]);
    return values;
  };
  using Run = Result;
  out.strings("/runs/case", column(results, [](const Run& r) { return r.name; }), "name");
  out.strings("/runs/source", column(results, [](const Run& r) { return r.source; }), "who says what is right");
  out.strings("/runs/backend", column(results, [](const Run& r) { return r.backend.name; }), "name");
  out.strings("/runs/options", column(results, [](const Run& r) { return r.backend.options; }), "empty: defaults");
  out.strings("/runs/executor", column(results, [](const Run& r) { return r.backend.executor; }),
              "cuda, host or reference");
  out.strings("/runs/device", column(results, [](const Run& r) { return r.backend.device; }), "what it ran on");
  out.integers("/runs/resolution", whole(results, [](const Run& r) { return r.resolution; }),
               "particles along the case's length");
  out.vector("/runs/particle_spacing", reals(results, [](const Run& r) { return r.particle_spacing; }), "m", "dx");
  out.integers("/runs/particles", whole(results, [](const Run& r) { return r.particles; }), "fluid");
  out.integers("/runs/wall_particles", whole(results, [](const Run& r) { return r.wall_particles; }),
               "of all containers");
  out.integers("/runs/substeps", whole(results, [](const Run& r) { return r.substeps; }), "in all");
  out.vector("/runs/simulated_seconds", reals(results, [](const Run& r) { return r.simulated_seconds; }), "s",
             "time covered");
  out.vector("/runs/solver_seconds", reals(results, [](const Run& r) { return r.solver_seconds; }), "s",
             "wall time, observer included");

  struct Row {
    std::int64_t run;
    const Quantity* quantity;
  };
  std::vector<Row> rows;
  for (std::size_t r = 0; r < results.size(); ++r)
    for (const auto& quantity : results[r].quantities) rows.push_back({static_cast<std::int64_t>(r), &quantity});
  out.integers("/quantities/run", whole(rows, [](const Row& r) { return r.run; }), "row of /runs");
  out.strings("/quantities/name", column(rows, [](const Row& r) { return r.quantity->name; }));
  out.strings("/quantities/unit", column(rows, [](const Row& r) { return r.quantity->unit; }),
              "of reference and result");
  out.vector("/quantities/reference", reals(rows, [](const Row& r) { return r.quantity->reference; }), "",
             "what should be; NaN: there is none");
  out.vector("/quantities/result", reals(rows, [](const Row& r) { return r.quantity->result; }), "", "what was found");
  out.vector("/quantities/error", reals(rows, [](const Row& r) { return r.quantity->error; }), "1",
             "what is compared with the allowance");
  out.vector("/quantities/allowance", reals(rows, [](const Row& r) { return r.quantity->allowance; }), "1",
             "NaN: reported, not gated");
  out.strings("/quantities/verdict", column(rows, [](const Row& r) { return std::string(verdict_of(*r.quantity)); }),
              "pass, fail or reported");

  out.group("/curves");
  int number = 0;
  for (std::size_t r = 0; r < results.size(); ++r)
    for (const auto& curve : results[r].curves) {
      const std::string group = fmt::format("/curves/{:04}", number++);
      out.vector(group + "/x",
                 Eigen::Map<const Eigen::VectorXd>(curve.x.data(), static_cast<Eigen::Index>(curve.x.size())),
                 curve.x_unit, curve.x_name);
      out.vector(group + "/y",
                 Eigen::Map<const Eigen::VectorXd>(curve.y.data(), static_cast<Eigen::Index>(curve.y.size())),
                 curve.y_unit, curve.y_name);
      out.attribute(group, "run", static_cast<std::int64_t>(r));
      out.attribute(group, "panel", curve.panel);
      out.attribute(group, "name", curve.name);
      out.attribute(group, "reference", static_cast<std::int64_t>(curve.reference));
    }

  const auto orders = observed_orders(results);
  out.strings("/orders/case", column(orders, [](const ObservedOrder& o) { return o.name; }));
  out.strings("/orders/quantity", column(orders, [](const ObservedOrder& o) { return o.quantity; }));
  out.integers("/orders/coarse", whole(orders, [](const ObservedOrder& o) { return o.coarse; }), "resolution");
  out.integers("/orders/fine", whole(orders, [](const ObservedOrder& o) { return o.fine; }), "resolution");
  out.vector("/orders/order", reals(orders, [](const ObservedOrder& o) { return o.order; }), "1",
             "log(coarse error / fine error) / log(fine / coarse)");
  out.commit();
}

}  // namespace decant::validate
