#pragma once
/// Errors of a scene, with their place. Thrown only for bad input; caught in command_line.cpp.

#include <stdexcept>
#include <string>
#include <vector>

namespace offstage {

/// A place in a scene file. `path` is a JSON pointer such as /emitters/0/rate.
struct Where {
  std::string file;
  /// Position in the file, from 1; 0: not from a file, but from an override or a default.
  int line = 0, column = 0;
  std::string path;
};

/// Greatest number of problems that are listed; the rest are only counted.
inline constexpr std::size_t kMostProblems = 50;

/// One problem. describe() returns "FILE:LINE:COLUMN: /PATH: the error; the allowed values".
struct Problem {
  Where where;
  std::string what;

  std::string describe() const;
};

/// An invalid scene, with the problems found. Of more than kMostProblems problems only the first ones are
/// listed; the last entry then gives the number of the others.
class SceneError : public std::runtime_error {
 public:
  explicit SceneError(std::vector<Problem> problems);
  SceneError(const Where& where, const std::string& what) : SceneError(std::vector{Problem{where, what}}) {}
  const std::vector<Problem>& problems() const { return problems_; }

 private:
  std::vector<Problem> problems_;
};

}  // namespace offstage
