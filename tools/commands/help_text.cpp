/// \file
/// Two columns, the left one as wide as most options are.
#include "tools/commands/help_text.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace decant {
namespace {

constexpr std::size_t left_column = 24;

std::string two_columns(const std::string& left, const std::string& right) {
  std::string out = "  " + left;
  if (right.empty()) return out + "\n";
  if (out.size() + 2 > left_column) out += "\n" + std::string(left_column, ' ');
  else out.resize(left_column, ' ');
  for (const char c : reflowed(right, help_width - left_column)) {
    out += c;
    if (c == '\n') out.append(left_column, ' ');
  }
  return out + "\n";
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines(1);
  for (const char c : text)
    if (c == '\n') lines.emplace_back();
    else lines.back() += c;
  return lines;
}

/// Where the meaning begins in "  term   meaning"; 0 in other lines.
std::size_t meaning_in(const std::string& line) {
  const std::size_t term = line.find_first_not_of(' ');
  if (term == std::string::npos || term == 0) return 0;
  const std::size_t gap = line.find("  ", term);
  if (gap == std::string::npos) return 0;
  const std::size_t meaning = line.find_first_not_of(' ', gap);
  return meaning == std::string::npos ? 0 : meaning;
}

std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

}  // namespace

std::string reflowed(const std::string& text, std::size_t width) {
  std::string out, line;
  const auto flush = [&] {
    if (!line.empty()) out += line + "\n";
    line.clear();
  };
  const std::vector<std::string> lines = lines_of(text);
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const std::string& given = lines[k];
    if (given.empty() || given.front() == ' ') {
      flush();
      const std::size_t meaning = meaning_in(given);
      if (meaning == 0 || meaning + 20 > width) {
        out += given + "\n";
        continue;
      }
      std::string words = given.substr(meaning);
      while (k + 1 < lines.size() && lines[k + 1].find_first_not_of(' ') == meaning)
        words += " " + lines[++k].substr(meaning);
      std::string lead = given.substr(0, meaning);
      for (const std::string& part : lines_of(reflowed(words, width - meaning))) {
        out += lead + part + "\n";
        lead.assign(meaning, ' ');
      }
      continue;
    }
    for (std::size_t at = 0; at < given.size();) {
      const std::size_t end = std::min(given.find(' ', at), given.size());
      const std::string word = given.substr(at, end - at);
      at = end + 1;
      if (word.empty()) continue;
      if (!line.empty() && line.size() + 1 + word.size() > width) flush();
      line += (line.empty() ? "" : " ") + word;
    }
    // A heading of what follows, as in "Example:", stands alone.
    if (!given.empty() && given.back() == ':') flush();
  }
  flush();
  while (!out.empty() && out.back() == '\n') out.pop_back();
  return out;
}

std::string HelpText::make_option(const CLI::Option* option, bool is_positional) const {
  return two_columns(make_option_name(option, is_positional) + make_option_opts(option), make_option_desc(option));
}

std::string HelpText::make_subcommand(const CLI::App* verb) const {
  return two_columns(verb->get_display_name(true), verb->get_description());
}

std::string HelpText::make_description(const CLI::App* app) const {
  return reflowed(CLI::Formatter::make_description(app), help_width) + "\n";
}

std::string HelpText::make_footer(const CLI::App* app) const {
  const std::string text = reflowed(CLI::Formatter::make_footer(app), help_width);
  return text.empty() ? text : text + "\n";
}

std::string nearest_name(const std::string& word, const std::vector<std::string>& names) {
  std::string nearest;
  std::size_t least = word.size() / 3 + 1;
  for (const std::string& name : names)
    if (const std::size_t d = distance(word, name); d < least) {
      least = d;
      nearest = name;
    }
  return nearest;
}

std::string explained(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& arguments) {
  const auto meant = [](const std::string& name) {
    return name.empty() ? std::string() : fmt::format("; did you mean {}?", name);
  };
  const auto verbs = app.get_subcommands();
  if (verbs.empty()) {
    if (arguments.empty() || arguments.front().starts_with("-")) return fmt::format("{} (decant --help)", error.what());
    std::vector<std::string> names;
    for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; }))
      names.push_back(verb->get_name());
    return fmt::format("'{}' is no command{} (decant --help lists them)", arguments.front(),
                       meant(nearest_name(arguments.front(), names)));
  }
  const CLI::App& verb = *verbs.back();
  const std::string help = fmt::format("(decant {} --help)", verb.get_name());
  const std::vector<std::string> names = option_names(verb);
  for (const std::string& argument : arguments) {
    const std::string name = argument.substr(0, argument.find('='));
    if (name.size() > 2 && name.starts_with("--") && std::find(names.begin(), names.end(), name) == names.end())
      return fmt::format("{}: {} is no option{} {}", verb.get_name(), name, meant(nearest_name(name, names)), help);
  }
  return fmt::format("{}: {} {}", verb.get_name(), error.what(), help);
}

}  // namespace decant
