/// \file
/// Help that fits 80 columns, and what is said of a command line that makes no sense.
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace decant {

inline constexpr std::size_t help_width = 80;  // columns

/// Words of a text broken into lines of at most `width` columns. A line that begins with a space stays as it is, so
/// that commands can be copied, unless it is a term and, two spaces or more apart, what it means: then that is broken
/// beside it, with the lines that go on in its column. An empty line ends a paragraph.
std::string reflowed(const std::string& text, std::size_t width);

/// CLI11's help with every text reflowed.
class HelpText : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_subcommand(const CLI::App* verb) const override;
  std::string make_description(const CLI::App* app) const override;
  std::string make_footer(const CLI::App* app) const override;
};

/// The name that a mistyped word is nearest to, by insertions, deletions, replacements and exchanges of neighbors;
/// empty where more than a third of its letters differ.
std::string nearest_name(const std::string& word, const std::vector<std::string>& names);

/// One line for what CLI11 could not read, with the verb's own help and the name that was probably meant.
/// \param arguments  after the program's name
std::string explained(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& arguments);

}  // namespace decant
