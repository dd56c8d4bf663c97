// A mip level of a map of columns.
@group(0) @binding(1) var coarse: texture_storage_2d<rgba32float, write>;
