#pragma once
/// Many small pictures in one: a grid with a heading above and a label under each.

#include <string>
#include <vector>

#include "render/image.h"

namespace offstage::producer {

struct SheetCell {
  std::vector<std::string> label;  ///< lines
  render::Image picture;           ///< none: `fault` stands in its place
  std::string fault = {};
};

/// Draws the sheet, cell after cell in rows of `columns`. What is too long for its place is cut: a label at
/// its start, where paths are least telling, the heading at its end.
render::Image contact_sheet(const std::vector<std::string>& heading, const std::vector<SheetCell>& cells,
                            int columns);

/// Throws std::invalid_argument if a sheet of so many pictures would be larger than a PNG should be.
void check_sheet_size(std::size_t cells, int columns, int width_px, int height_px);

/// Columns for so many pictures of one series: one row of few, else about as many as rows, with the fewest
/// places left empty.
int columns_for(std::size_t cells);

}  // namespace offstage::producer
