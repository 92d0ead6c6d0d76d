/// \file
/// States by name, fields by name, particles by id.
#include "oracle/files/named_fields.hpp"

#include "oracle/files/foreign_file.hpp"
#include "oracle/solution/sum_bound.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

namespace decant {
namespace {

/// Values by particle, and by component within one: [N], [N,K] or [N,K,L], the last index fastest.
struct NamedField {
  Eigen::VectorXd values;
  std::vector<std::int64_t> shape;
  int components = 1;
  bool integers = false;
  std::string unit;
};

constexpr double exact_integers = 0x1p53;  // beyond, a double skips some

std::string in_words(const std::vector<std::int64_t>& shape) { return fmt::format("[{}]", fmt::join(shape, ",")); }

/// "[0,2]" of a component of a tensor.
std::string entry(std::int64_t component, const NamedField& field) {
  if (field.shape.size() < 3) return fmt::format("[{}]", component);
  return fmt::format("[{},{}]", component / field.shape[2], component % field.shape[2]);
}

NamedField read_field(const Hdf5Reader& in, const std::string& path, std::int64_t n) {
  NamedField field;
  field.shape = in.shape(path);
  field.integers = in.holds_integers(path);
  if (field.integers) {
    field.values = flat(in.integer_values(path, n));
    for (Eigen::Index k = 0; k < field.values.size(); ++k)
      if (!(std::abs(field.values[k]) <= exact_integers))
        in.fail(path, fmt::format("{:.0f} at {}", field.values[k], k), "within 2^53");
  } else {
    field.values = in.reals(path, n);
  }
  for (std::size_t axis = 1; axis < field.shape.size(); ++axis) field.components *= static_cast<int>(field.shape[axis]);
  if (in.has_attribute(path, "unit")) field.unit = in.text_attribute(path, "unit");
  return field;
}

void require(const Hdf5Reader& in, const std::string& path, const Eigen::VectorXd& values, bool negative_too) {
  for (Eigen::Index k = 0; k < values.size(); ++k)
    if (!std::isfinite(values[k]) || !(negative_too || values[k] >= 0))
      in.fail(path, fmt::format("{:.9g} at {}", values[k], k), negative_too ? "finite" : "finite, >= 0");
}

/// A real attribute that may be missing. Throws where it is not finite or below 0.
std::optional<double> stated(const Hdf5Reader& in, const std::string& object, const std::string& name) {
  if (!in.has_attribute(object, name)) return {};
  const double value = in.real_attribute(object, name);
  if (!(value >= 0 && std::isfinite(value))) in.fail(object + "@" + name, fmt::format("{:.9g}", value), "finite, >= 0");
  return value;
}

/// "" where the file itself is one state, "/name" of every group that is one.
std::vector<std::string> states_of(const Hdf5Reader& in) {
  std::vector<std::string> states;
  if (in.has("/fields")) states.push_back("");
  for (const auto& name : in.children("/"))
    if (in.has("/" + name + "/fields")) states.push_back("/" + name);
  if (states.empty()) in.fail("/fields", "missing", "at the root, or in a group for each state");
  if (states.size() > 1 && states.front().empty())
    in.fail(states[1] + "/fields", "beside /fields", "one state at the root, or several in groups");
  return states;
}

/// One state of a file: its ids and its fields.
struct State {
  const Hdf5Reader& in;
  std::string path;
  std::vector<std::string> names;
  std::int64_t n = 0;
  bool has_ids = false;
  IdVector ids;
  Eigen::Matrix3Xd position;  // 3×N, 0 along axes that it does not have; empty where it is not there

  State(const Hdf5Reader& file, std::string group) : in(file), path(std::move(group)) {
    names = in.children(path + "/fields");
    has_ids = in.has(path + "/id");
    if (has_ids) {
      ids = in.integers(path + "/id");
      n = ids.size();
    } else if (!names.empty()) {
      const auto shape = in.shape(field(names.front()));
      if (!shape.empty()) n = shape[0];
      ids = IdVector::LinSpaced(n, 0, n - 1);
    }
    if (in.has(path + "/position")) read_position();
  }
  void read_position() {
    const std::string at = path + "/position";
    const NamedField found = read_field(in, at, n);
    if (found.integers || found.components > 3)
      in.fail(at, found.integers ? "integers" : in_words(found.shape), "reals, [N], [N,2] or [N,3]");
    position.setZero(3, n);
    position.topRows(found.components) = found.values.reshaped(found.components, n);
  }
  std::string field(const std::string& name) const { return path + "/fields/" + name; }
  bool has(const std::string& name) const { return std::find(names.begin(), names.end(), name) != names.end(); }
};

/// (√n + c) (u + u_ref) C of every value; empty where the field has no condition sum.
Eigen::VectorXd derived_tolerance(const State& oracle, const std::string& name, const NamedField& field) {
  const Hdf5Reader& in = oracle.in;
  const std::string path = oracle.path + "/condition/" + name;
  const std::string terms_path = oracle.path + "/terms/" + name;
  if (!in.has(path)) {
    if (in.has(terms_path)) in.fail(path, "missing", "required beside " + terms_path);
    return {};
  }
  const NamedField sums = read_field(in, path, oracle.n);
  if (sums.shape != field.shape) in.fail(path, in_words(sums.shape), "the field's shape, " + in_words(field.shape));
  require(in, path, sums.values, false);
  const double u = stated(in, path, "precision").value_or(unit_roundoff);
  const double own = stated(in, path, "reference_precision").value_or(reference_roundoff);
  const double c = stated(in, path, "c").value_or(default_roundings);
  if (!(u > 0 && u < 1)) in.fail(path + "@precision", fmt::format("{:.9g}", u), "in 0 … 1");
  if (!(own < 1)) in.fail(path + "@reference_precision", fmt::format("{:.9g}", own), "in 0 … 1");

  Eigen::VectorXd terms;
  if (in.has(terms_path)) {
    terms = flat(in.integers(terms_path, oracle.n));
    require(in, terms_path, terms, false);
  } else if (const auto same_for_all = stated(in, path, "terms")) {
    terms.setConstant(oracle.n, *same_for_all);
  } else {
    in.fail(terms_path, "missing", "the number of terms of each sum, here or in " + path + "@terms");
  }
  Eigen::VectorXd tolerance(sums.values.size());
  for (Eigen::Index k = 0; k < tolerance.size(); ++k)
    tolerance[k] = (std::sqrt(terms[k / field.components]) + c) * (u + own) * sums.values[k];
  return tolerance;
}

/// STATE/tolerance/NAME, by value or by particle; empty where there is none.
Eigen::VectorXd given_tolerance(const State& oracle, const std::string& name, const NamedField& field) {
  const std::string path = oracle.path + "/tolerance/" + name;
  if (!oracle.in.has(path)) return {};
  NamedField given = read_field(oracle.in, path, oracle.n);
  require(oracle.in, path, given.values, false);
  if (given.shape == field.shape) return given.values;
  if (given.shape.size() != 1)
    oracle.in.fail(path, in_words(given.shape),
                   fmt::format("the field's shape, {}, or one value per particle", in_words(field.shape)));
  return given.values.transpose().replicate(field.components, 1).reshaped();
}

/// √(Σx²/count), also where squares overflow.
double root_mean_square(const Eigen::VectorXd& values) {
  const double largest = values.size() ? values.cwiseAbs().maxCoeff() : 0;
  if (!(largest > 0)) return largest;
  return largest * std::sqrt((values / largest).squaredNorm() / static_cast<double>(values.size()));
}

/// tau of every value, or empty where the reference states nothing to judge by.
Eigen::VectorXd tolerance_of(const State& oracle, const std::string& name, const NamedField& field) {
  const std::string path = oracle.field(name);
  Eigen::VectorXd tolerance = derived_tolerance(oracle, name, field);
  const Eigen::VectorXd given = given_tolerance(oracle, name, field);
  const auto absolute = stated(oracle.in, path, "tolerance");
  const auto relative = stated(oracle.in, path, "relative");
  if (tolerance.size() == 0) {
    if (given.size() == 0 && !absolute && !relative && !field.integers) return {};
    tolerance.setZero(field.values.size());
  }
  if (given.size() > 0) tolerance += given;
  tolerance.array() += absolute.value_or(0) + relative.value_or(0) * root_mean_square(field.values);
  for (Eigen::Index k = 0; k < tolerance.size(); ++k)
    if (!std::isfinite(tolerance[k]))
      oracle.in.fail(path, fmt::format("a tolerance beyond {:.3g} at {}", std::numeric_limits<double>::max(), k),
                     "values and condition sums whose tolerance is a finite double");
  return tolerance;
}

void check_field(const State& oracle, const State& port, const Matching& ids, const std::string& name,
                 RowBuilder& builder) {
  const std::string path = port.field(name);
  const NamedField expected = read_field(oracle.in, oracle.field(name), oracle.n);
  require(oracle.in, oracle.field(name), expected.values, true);
  const Eigen::VectorXd tolerance = tolerance_of(oracle, name, expected);
  CheckRow& row = builder.row("fields", name, expected.unit.c_str());
  if (!port.has(name)) {
    row.reason = not_given;
    return;
  }
  const NamedField got = read_field(port.in, path, port.n);
  if (!std::equal(got.shape.begin() + 1, got.shape.end(), expected.shape.begin() + 1, expected.shape.end()))
    port.in.fail(path, in_words(got.shape), "the reference's shape, " + in_words(expected.shape));
  if (!got.unit.empty() && !expected.unit.empty() && got.unit != expected.unit)
    port.in.fail(path + "@unit", got.unit, expected.unit);
  if (!ids.ok()) {
    row.reason = "the ids do not tell which particle is which";
    return;
  }
  if (tolerance.size() == 0) {
    row.reason =
        fmt::format("{} has no tolerance for it: neither /condition nor /tolerance nor @tolerance nor @relative",
                    oracle.in.file().filename().string());
    return;
  }
  const Eigen::Map<const Eigen::MatrixXd> found(got.values.data(), got.components, port.n);
  const Eigen::MatrixXd ordered = found(Eigen::all, ids.place);
  compare({flat(ordered), expected.values, tolerance, {}, expected.components, nullptr, 0}, row);
  if (row.worst_id < 0) return;
  if (expected.components > 3) {
    if (row.verdict == Verdict::fail) row.reason = "beyond tolerance at entry " + entry(row.worst_component, expected);
    row.worst_component = -1;
  }
  if (oracle.position.size() > 0 && row.verdict == Verdict::fail) {
    row.worst_x = oracle.position(0, row.worst_id);
    row.worst_y = oracle.position(1, row.worst_id);
    row.worst_z = oracle.position(2, row.worst_id);
  }
  row.worst_id = oracle.ids[row.worst_id];
}

void check_state(const State& oracle, const State& port, RowBuilder& builder) {
  if (oracle.n == 0) oracle.in.fail(oracle.path + "/fields", "no particle", "at least one field, one particle");
  // Without ids a wrong number of particles is a wrong shape; with them, ids that are missing.
  if (!oracle.has_ids && !port.has_ids && port.n != oracle.n && !port.names.empty())
    port.in.fail(port.field(port.names.front()), fmt::format("{} particles", port.n),
                 fmt::format("{}, as the reference has", oracle.n));
  if (const Matching own = match_ids(oracle.ids, oracle.ids); !own.ok())
    oracle.in.fail(oracle.path + "/id", own.mismatch, "each id once");
  for (const char* group : {"/condition", "/terms", "/tolerance"})
    if (oracle.in.has(oracle.path + group))
      for (const auto& name : oracle.in.children(oracle.path + group))
        if (!oracle.has(name))
          oracle.in.fail(oracle.path + group + "/" + name, "of no field", "one of " + oracle.path + "/fields");
  const Matching ids = match_ids(oracle.ids, port.ids);
  if (oracle.has_ids || port.has_ids) check_ids(ids, oracle.n, builder);
  for (const auto& name : oracle.names) check_field(oracle, port, ids, name, builder);
  for (const auto& name : port.names)
    if (!oracle.has(name))
      builder.row("fields", name, "").reason = oracle.in.file().filename().string() + " has no such field";
}

}  // namespace

CheckedResults check_named_fields(const std::filesystem::path& reference, const std::filesystem::path& results,
                                  const std::string& name) {
  const Hdf5Reader oracle = open_foreign(reference), port = open_foreign(results);
  for (const auto& [in, kind, schema] :
       {std::tuple{&oracle, "decant_reference", reference_schema}, std::tuple{&port, "decant_results", results_schema}})
    if (const std::int64_t found = in->integer_attribute("/", kind); found != schema)
      in->fail(fmt::format("/@{}", kind), std::to_string(found), std::to_string(schema));

  BackendInfo info{name, "", "file", "", ""};
  if (port.has_attribute("/", "device")) info.device = port.text_attribute("/", "device");
  const auto expected = states_of(oracle), found = states_of(port);
  const auto has = [](const std::vector<std::string>& states, const std::string& state) {
    return std::find(states.begin(), states.end(), state) != states.end();
  };
  CheckedResults judged;
  judged.states = static_cast<std::int64_t>(expected.size());
  for (const auto& state : expected) {
    RowBuilder builder(info, reference.stem().string() + state);
    const State theirs(oracle, state);
    if (has(found, state)) {
      check_state(theirs, State(port, state), builder);
    } else {
      judged.missing_states.push_back(state.empty() ? "/" : state);
      for (const auto& field : theirs.names) builder.row("fields", field, "").reason = not_given;
    }
    judged.add(builder.take());
  }
  for (const auto& state : found) {
    if (has(expected, state)) continue;
    RowBuilder builder(info, reference.stem().string() + state);
    builder.row("fields", "all", "").reason = oracle.file().filename().string() + " has no such state";
    judged.add(builder.take());
  }
  return judged;
}

}  // namespace decant
