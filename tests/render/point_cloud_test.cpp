#include "render/point_cloud.h"

#include <algorithm>
#include <cstring>

#include <gtest/gtest.h>

#include "render/error.h"
#include "scratch.h"

namespace offstage::render {
namespace {

std::string bytes_of_floats(std::initializer_list<float> values, bool big_endian) {
  std::string bytes;
  for (const float value : values) {
    char own[4];
    std::memcpy(own, &value, 4);
    if (big_endian) std::reverse(own, own + 4);
    bytes.append(own, 4);
  }
  return bytes;
}

PointCloud read(const std::string& name, const std::string& content) {
  const ScratchFolder folder;
  return read_points(folder.put(name, content));
}

std::string why_not(const std::string& name, const std::string& content) {
  try {
    read(name, content);
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

TEST(PointClouds, AreReadFromEveryFormOfPly) {
  const std::string vertices =
      "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const PointCloud text = read("a.ply", "ply\nformat ascii 1.0\ncomment c\n" + vertices +
                                            "1 2 3 255 0 188\n-4 5e-1 +6 0 255 0\n3 0 1 1\n");
  ASSERT_EQ(text.positions.size(), 2u);
  EXPECT_EQ(text.positions[1], Vector3f(-4, 0.5f, 6));
  EXPECT_EQ(text.colors[1], Vector4f(0, 1, 0, 1));
  for (const bool big : {false, true}) {
    const std::string form = big ? "binary_big_endian" : "binary_little_endian";
    const PointCloud cloud =
        read("a.PLY", "ply\r\nformat " + form + " 1.0\n" + vertices + bytes_of_floats({1, 2, 3}, big) +
                          std::string("\xff\x00\xbc", 3) + bytes_of_floats({-4, 0.5f, 6}, big) +
                          std::string("\x00\xff\x00", 3));
    ASSERT_EQ(cloud.positions.size(), 2u) << form;
    EXPECT_EQ(cloud.positions[1], Vector3f(-4, 0.5f, 6)) << form;
    ASSERT_EQ(cloud.colors.size(), 2u) << form;
    EXPECT_LT((cloud.colors[0] - Vector4f(1, 0, 0.5029f, 1)).norm(), 1e-3f) << "sRGB 188 is half of white";
  }
}

TEST(PointClouds, AreReadFromTheVerticesOfObjFiles) {
  const PointCloud plain = read("a.obj", "# points\nv 1 2 3\nv 4 5 6 1\nvn 0 0 1\np 1 2\n");
  ASSERT_EQ(plain.positions.size(), 2u);
  EXPECT_TRUE(plain.colors.empty());
  const PointCloud colored = read("a.obj", "v 1 2 3 1 0 0\r\nv nan 0 0 0 1 0\nv 4 5 6 0 1 0\n");
  ASSERT_EQ(colored.positions.size(), 2u) << "a point that is not finite is left out";
  EXPECT_EQ(colored.colors[1], Vector4f(0, 1, 0, 1));
}

TEST(PointClouds, LiesAreRefused) {
  const std::string head = "ply\nformat binary_little_endian 1.0\nelement vertex ";
  const std::string xyz = "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  EXPECT_NE(why_not("a.ply", head + "1000000" + xyz + "short").find("cut short"), std::string::npos);
  EXPECT_NE(why_not("a.ply", head + "99999999999" + xyz).find("must be from 0 to"), std::string::npos);
  EXPECT_NE(why_not("a.ply", head + "1\nproperty float x\nend_header\n1234").find("no x, y and z"),
            std::string::npos);
  EXPECT_NE(why_not("a.ply", head + "1\nproperty list uchar int x" + xyz).find("type 'list'"),
            std::string::npos);
  EXPECT_NE(why_not("a.ply", "ply\n").find("no end"), std::string::npos);
  EXPECT_NE(why_not("a.obj", "v a 2 3\n").find("three numbers"), std::string::npos);
  EXPECT_NE(why_not("a.obj", "f 1 2 3\n").find("no points"), std::string::npos);
  EXPECT_NE(why_not("a.stl", "solid").find("PLY or OBJ"), std::string::npos);
}

}  // namespace
}  // namespace offstage::render
