// SPDX-License-Identifier: MIT OR Apache-2.0
// OpenGL's numbers, so that its headers, which differ between versions of VTK, are not needed.
#pragma once

namespace OpenGL
{

const unsigned int One = 1, OneMinusSourceAlpha = 0x0303, Add = 0x8006, Largest = 0x8008;
const unsigned int DepthTest = 0x0B71, Blend = 0x0BE2, CullFace = 0x0B44, ScissorTest = 0x0C11;
const unsigned int Viewport = 0x0BA2, DrawFramebuffer = 0x8CA9;

}
