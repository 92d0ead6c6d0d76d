/// \file
/// One line per problem, set of forms and field; their table by field and by choice.
#include "tests/studies/forms.hpp"

#include "oracle/checks/conform.hpp"
#include "oracle/files/fixture_file.hpp"
#include "reference/sampling.hpp"
#include "tests/forms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace decant {
namespace {

constexpr char separator = '\t';

std::vector<std::string> columns_of(const std::string& line) {
  std::vector<std::string> columns(1);
  for (const char c : line)
    if (c == separator) columns.emplace_back();
    else columns.back() += c;
  return columns;
}

struct Worst {
  double score = -1;
  std::string problem;
  std::int64_t values = 0;

  void add(double of_line, const std::string& name) {
    ++values;
    if (!(of_line <= score)) {
      score = of_line;
      problem = name;
    }
  }
};

}  // namespace

std::string lines_of_forms(const std::vector<std::string>& fixtures, std::uint32_t k, std::uint32_t first, int tries) {
  const bool recorded = k < fixtures.size();
  const std::uint32_t seed = recorded ? k : first + k - static_cast<std::uint32_t>(fixtures.size());
  const Fixture fixture = recorded ? read_fixture(fixtures[k]) : test::random_form_case(seed);
  const Walls walls = sample_walls(fixture.scene);
  const WallSolution volumes = wall_solution(fixture.scene, walls);
  const ReferenceSolution own = reference_solution(fixture.scene, walls, volumes, fixture.state);
  StageInputs staged;
  staged.density = own.fields.density.cast<float>().cast<double>();
  staged.pressure = own.fields.pressure.cast<float>().cast<double>();
  const ReferenceSolution given = reference_solution(fixture.scene, walls, volumes, fixture.state, &staged);
  std::mt19937 random(seed);
  std::string lines;
  for (int t = 0; t < tries; ++t) {
    const test::Forms forms = test::random_forms(random);
    std::string chosen;
    for (const auto& [name, value] : test::choices(forms)) chosen += fmt::format("{}: {}{}", name, value, separator);
    const auto put = [&](const Fields& got, const ReferenceSolution& oracle, const char* stage) {
      for (const auto& [field, score] : test::scores(got, oracle)) {
        if (oracle.fields.density.size() == 0) continue;
        const bool once = field == "boundary_volume" || field == "density";
        if (once && stage[0] != '\0') continue;  // these two do not depend on what is given
        lines += fmt::format("{}{}{}{}{}{}{}\n", fixture.name, separator, chosen, field, stage, separator, score);
      }
    };
    put(test::evaluate_by(forms, fixture.scene, walls, fixture.state), own, "");
    put(test::evaluate_by(forms, fixture.scene, walls, fixture.state, &staged), given, ", staged");
  }
  return lines;
}

FormsTable table_of_forms(const std::vector<std::string>& lines) {
  std::map<std::string, Worst> by_field, by_choice;
  std::map<std::string, std::vector<double>> all;
  std::map<std::string, int> problems;
  FormsTable table;
  std::string above;
  for (const std::string& line : lines) {
    const std::vector<std::string> columns = columns_of(line);
    const std::string& problem = columns.front();
    const std::string& field = columns[columns.size() - 2];
    const double score = std::stod(columns.back());
    ++problems[problem];
    by_field[field].add(score, problem);
    all[field].push_back(score);
    for (std::size_t c = 1; c + 2 < columns.size(); ++c) by_choice[columns[c]].add(score, problem);
    if (score <= 1) continue;
    ++table.above;
    above += fmt::format("{}: {} scores {:.3g}\n", problem, field, score);
  }
  table.problems = static_cast<std::int64_t>(problems.size());
  table.text = fmt::format("{:<42} {:>9} {:>8} {:>8} {:>8}  {}\n", "field, largest score of a set of forms", "sets",
                           "median", "p99", "largest", "of");
  for (auto& [field, worst] : by_field) {
    auto& scores = all[field];
    std::sort(scores.begin(), scores.end());
    const auto quantile = [&](double share) {
      return scores[static_cast<std::size_t>(share * static_cast<double>(scores.size() - 1))];
    };
    table.text += fmt::format("{:<42} {:>9} {:>8.3f} {:>8.3f} {:>8.3f}  {}\n", field, worst.values, quantile(0.5),
                              quantile(0.99), worst.score, worst.problem);
  }
  table.text += fmt::format("\n{:<42} {:>9} {:>26}\n", "form", "rows", "largest");
  for (const auto& [choice, worst] : by_choice)
    table.text += fmt::format("{:<42} {:>9} {:>26.3f}  {}\n", choice, worst.values, worst.score, worst.problem);
  table.text += "\n" + above + fmt::format("{} scores above 1\n", table.above);
  return table;
}

}  // namespace decant
