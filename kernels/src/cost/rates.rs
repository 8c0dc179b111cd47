//! Written by `cargo xtask fit`: expected instructions, expected cycles, instructions at most.

#[rustfmt::skip]
pub(super) const RATES: &[[f64; 3]] = &[
    [100.283, 186.601, 100.283], // a step, with its operations and its action aside
    [10.498, 13.496, 10.498], // a value of the observation
    [271.700, 410.426, 271.700], // an action
    [22.601, 38.939, 22.601], // a value of the action
    [8.935, 10.661, 9.857], // a value of an array of the action contract
    [83.714, 176.612, 83.714], // a call that runs one operation
    [0.000, 0.000, 83.714], // a call that runs pieces
    [0.000, 0.000, 40.041], // an operation that a poll comes to
    [0.000, 0.000, 246.329], // a piece
    [419.932, 764.607, 419.932], // a linear operation
    [0.000, 0.000, 965.817], // a block of rows of a linear operation that a poll comes to
    [26.900, 36.851, 26.900], // eight values compared by magnitude
    [10.319, 13.887, 10.319], // a value compared by magnitude
    [247.906, 413.576, 247.906], // a block of rows whose order is looked at
    [57.915, 87.853, 57.915], // a linear operation that sets its output up before the rows are added
    [1.798, 3.418, 1.798], // an output set to 0 before the rows are added
    [4.030, 6.072, 4.030], // an output set to its bias before the rows are added
    [128.563, 174.803, 128.563], // a block of rows in order, whole strips
    [83.799, 216.160, 83.799], // a block of rows with sums on the stack
    [146.540, 157.145, 146.540], // a run of rows with sums on the stack
    [91.106, 137.558, 91.106], // eight rows scaled by the assembler
    [30.214, 38.105, 30.214], // a row in order scaled
    [41.678, 56.769, 41.678], // a row with an index scaled
    [284.778, 480.204, 284.778], // a normalization
    [24.506, 28.504, 24.591], // a value normalized
    [304.119, 533.256, 304.119], // a layer norm
    [17.763, 25.512, 17.763], // a value of a layer norm
    [259.409, 473.431, 259.409], // an RMS norm
    [10.251, 12.496, 10.251], // a value of an RMS norm
    [216.097, 390.721, 216.097], // an addition
    [5.248, 6.745, 5.248], // a value added
    [215.888, 390.344, 215.888], // a copy
    [2.749, 4.249, 2.749], // a value copied
    [284.754, 524.897, 284.754], // an LSTM cell
    [204.940, 378.808, 204.995], // an element of an LSTM cell
    [304.493, 546.043, 304.493], // a GRU cell
    [134.973, 246.915, 134.998], // an element of a GRU cell
    [180.126, 350.561, 180.126], // a function's operation
    [8.065, 9.057, 8.278], // an element of relu
    [20.918, 32.788, 34.187], // an element of elu
    [38.048, 74.336, 38.187], // an element of silu
    [68.007, 119.521, 68.065], // an element of gelu
    [45.049, 86.331, 45.187], // an element of gelu_tanh
    [48.010, 86.032, 48.065], // an element of tanh
    [38.048, 74.336, 38.187], // an element of sigmoid
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a group
    [810.073, 1341.220, 810.073], // 2 bits single rows prepared: a chunk
    [86.399, 110.281, 86.399], // 2 bits single rows prepared: a chunk written by itself
    [32.142, 46.235, 32.142], // 2 bits single rows prepared: eight values
    [16.596, 22.894, 16.596], // 2 bits single rows prepared: a value of the rest
    [2.163, 3.885, 2.163], // 2 bits single rows prepared: a pair of padding
    [706.249, 1189.778, 706.249], // 2 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single groups prepared: a group
    [119.926, 181.414, 119.926], // 2 bits single groups prepared: a chunk
    [106.197, 138.080, 106.197], // 2 bits single groups prepared: a chunk written by itself
    [32.730, 47.628, 32.730], // 2 bits single groups prepared: eight values
    [10.806, 12.916, 10.806], // 2 bits single groups prepared: a value of the rest
    [0.284, 1.212, 0.284], // 2 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a vector
    [816.025, 1385.715, 816.025], // 2 bits paired rows prepared: a group
    [3.137, 0.263, 3.137], // 2 bits paired rows prepared: a chunk
    [122.215, 191.518, 122.215], // 2 bits paired rows prepared: a chunk written by itself
    [38.599, 54.279, 38.599], // 2 bits paired rows prepared: eight values
    [10.917, 10.249, 10.917], // 2 bits paired rows prepared: a value of the rest
    [0.145, 0.000, 0.145], // 2 bits paired rows prepared: a pair of padding
    [694.710, 1239.727, 694.710], // 2 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a group
    [96.268, 167.447, 96.268], // 2 bits paired groups prepared: a chunk
    [113.430, 133.072, 113.430], // 2 bits paired groups prepared: a chunk written by itself
    [42.841, 55.302, 42.841], // 2 bits paired groups prepared: eight values
    [6.562, 5.994, 6.562], // 2 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a group
    [803.002, 1327.306, 803.002], // 3 bits single rows prepared: a chunk
    [92.050, 118.502, 92.050], // 3 bits single rows prepared: a chunk written by itself
    [32.190, 46.310, 32.190], // 3 bits single rows prepared: eight values
    [15.469, 21.084, 15.469], // 3 bits single rows prepared: a value of the rest
    [1.917, 3.621, 1.917], // 3 bits single rows prepared: a pair of padding
    [706.241, 1189.273, 706.241], // 3 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single groups prepared: a group
    [120.269, 181.997, 120.269], // 3 bits single groups prepared: a chunk
    [109.729, 142.931, 109.729], // 3 bits single groups prepared: a chunk written by itself
    [32.721, 47.618, 32.721], // 3 bits single groups prepared: eight values
    [10.333, 12.293, 10.333], // 3 bits single groups prepared: a value of the rest
    [0.000, 0.840, 0.000], // 3 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a vector
    [831.617, 1408.295, 831.617], // 3 bits paired rows prepared: a group
    [48.234, 65.321, 48.234], // 3 bits paired rows prepared: a chunk
    [64.379, 91.464, 64.379], // 3 bits paired rows prepared: a chunk written by itself
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: eight values
    [13.577, 19.167, 13.577], // 3 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a pair of padding
    [693.403, 1238.433, 693.403], // 3 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a group
    [75.836, 108.143, 75.836], // 3 bits paired groups prepared: a chunk
    [15.496, 22.358, 15.496], // 3 bits paired groups prepared: a chunk written by itself
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: eight values
    [12.804, 13.104, 12.804], // 3 bits paired groups prepared: a value of the rest
    [9.621, 13.888, 9.621], // 3 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a group
    [805.647, 1333.083, 805.647], // 4 bits single rows prepared: a chunk
    [90.222, 115.911, 90.222], // 4 bits single rows prepared: a chunk written by itself
    [32.131, 46.206, 32.131], // 4 bits single rows prepared: eight values
    [15.539, 21.133, 15.539], // 4 bits single rows prepared: a value of the rest
    [1.903, 3.519, 1.903], // 4 bits single rows prepared: a pair of padding
    [706.510, 1189.810, 706.510], // 4 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single groups prepared: a group
    [119.907, 181.601, 119.907], // 4 bits single groups prepared: a chunk
    [106.030, 138.933, 106.030], // 4 bits single groups prepared: a chunk written by itself
    [32.737, 47.623, 32.737], // 4 bits single groups prepared: eight values
    [10.939, 12.966, 10.939], // 4 bits single groups prepared: a value of the rest
    [0.306, 1.159, 0.306], // 4 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a vector
    [779.505, 1305.498, 779.505], // 4 bits paired rows prepared: a group
    [129.698, 214.659, 129.698], // 4 bits paired rows prepared: a chunk
    [26.684, 32.930, 26.684], // 4 bits paired rows prepared: a chunk written by itself
    [36.826, 51.253, 36.826], // 4 bits paired rows prepared: eight values
    [11.670, 16.236, 11.670], // 4 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a pair of padding
    [687.332, 1232.339, 687.332], // 4 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a group
    [169.593, 275.395, 169.593], // 4 bits paired groups prepared: a chunk
    [35.066, 22.095, 35.066], // 4 bits paired groups prepared: a chunk written by itself
    [45.753, 58.909, 45.753], // 4 bits paired groups prepared: eight values
    [5.951, 5.222, 5.951], // 4 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a group
    [795.340, 1317.563, 795.340], // 8 bits single rows prepared: a chunk
    [82.617, 107.926, 82.617], // 8 bits single rows prepared: a chunk written by itself
    [32.096, 46.060, 32.096], // 8 bits single rows prepared: eight values
    [14.512, 18.933, 14.512], // 8 bits single rows prepared: a value of the rest
    [2.232, 3.750, 2.232], // 8 bits single rows prepared: a pair of padding
    [706.714, 1189.508, 706.714], // 8 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single groups prepared: a group
    [119.985, 182.099, 119.985], // 8 bits single groups prepared: a chunk
    [106.537, 141.220, 106.537], // 8 bits single groups prepared: a chunk written by itself
    [32.742, 47.615, 32.742], // 8 bits single groups prepared: eight values
    [10.979, 12.884, 10.979], // 8 bits single groups prepared: a value of the rest
    [0.276, 1.009, 0.276], // 8 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a vector
    [800.872, 1331.813, 800.872], // 8 bits paired rows prepared: a group
    [17.572, 57.157, 17.572], // 8 bits paired rows prepared: a chunk
    [114.885, 155.366, 114.885], // 8 bits paired rows prepared: a chunk written by itself
    [32.219, 46.244, 32.219], // 8 bits paired rows prepared: eight values
    [9.471, 11.998, 9.471], // 8 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a pair of padding
    [684.228, 1228.004, 684.228], // 8 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a group
    [91.902, 152.780, 91.902], // 8 bits paired groups prepared: a chunk
    [115.199, 139.843, 115.199], // 8 bits paired groups prepared: a chunk written by itself
    [39.555, 54.445, 39.555], // 8 bits paired groups prepared: eight values
    [5.967, 4.229, 5.967], // 8 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a pair of padding
    [65.643, 130.774, 65.643], // 2 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 4 rows: a pass or group of a strip
    [8.682, 12.631, 8.682], // 2 bits single rows, 4 rows: a chunk of a strip
    [4.500, 5.435, 4.500], // 2 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a column of a strip
    [79.387, 158.847, 79.387], // 2 bits single groups, 4 rows: a call
    [7.941, 14.284, 7.941], // 2 bits single groups, 4 rows: a strip
    [26.374, 44.952, 26.374], // 2 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 4 rows: a chunk of a strip
    [4.503, 5.437, 4.503], // 2 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a call
    [93.081, 183.902, 93.081], // 2 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a pass or group of a strip
    [31.388, 50.134, 31.388], // 2 bits paired rows, 4 rows: a chunk of a strip
    [1.537, 2.067, 1.537], // 2 bits paired rows, 4 rows: a column of a strip
    [93.007, 177.773, 93.007], // 2 bits paired rows, 8 rows: a call
    [24.598, 42.175, 24.598], // 2 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 8 rows: a pass or group of a strip
    [17.756, 39.727, 17.756], // 2 bits paired rows, 8 rows: a chunk of a strip
    [4.215, 5.189, 4.215], // 2 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a call
    [101.923, 216.173, 101.923], // 2 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a chunk of a strip
    [2.791, 3.939, 2.791], // 2 bits paired groups, 4 rows: a column of a strip
    [90.065, 183.243, 90.065], // 2 bits paired groups, 8 rows: a call
    [13.099, 31.774, 13.099], // 2 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a chunk of a strip
    [5.377, 7.153, 5.377], // 2 bits paired groups, 8 rows: a column of a strip
    [69.606, 139.128, 69.606], // 3 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a pass or group of a strip
    [8.963, 13.002, 8.963], // 3 bits single rows, 4 rows: a chunk of a strip
    [5.187, 6.153, 5.187], // 3 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a column of a strip
    [78.892, 158.268, 78.892], // 3 bits single groups, 4 rows: a call
    [7.970, 14.390, 7.970], // 3 bits single groups, 4 rows: a strip
    [26.346, 44.896, 26.346], // 3 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 4 rows: a chunk of a strip
    [5.190, 6.156, 5.190], // 3 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a column of a strip
    [67.378, 142.399, 67.378], // 3 bits paired rows, 4 rows: a call
    [16.448, 28.487, 16.448], // 3 bits paired rows, 4 rows: a strip
    [6.717, 13.364, 6.717], // 3 bits paired rows, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 4 rows: a chunk of a strip
    [3.108, 4.110, 3.108], // 3 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a column of a strip
    [87.443, 182.885, 87.443], // 3 bits paired groups, 4 rows: a call
    [5.708, 15.147, 5.708], // 3 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a chunk of a strip
    [3.753, 5.128, 3.753], // 3 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a column of a strip
    [69.704, 138.206, 69.704], // 4 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 4 rows: a pass or group of a strip
    [8.611, 12.531, 8.611], // 4 bits single rows, 4 rows: a chunk of a strip
    [4.751, 6.124, 4.751], // 4 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a column of a strip
    [78.996, 158.287, 78.996], // 4 bits single groups, 4 rows: a call
    [7.963, 14.297, 7.963], // 4 bits single groups, 4 rows: a strip
    [26.385, 44.960, 26.385], // 4 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 4 rows: a chunk of a strip
    [4.753, 6.124, 4.753], // 4 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a call
    [40.965, 96.670, 40.965], // 4 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a pass or group of a strip
    [61.968, 96.505, 61.968], // 4 bits paired rows, 4 rows: a chunk of a strip
    [3.410, 4.382, 3.410], // 4 bits paired rows, 4 rows: a column of a strip
    [84.096, 161.545, 84.096], // 4 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits paired rows, 8 rows: a strip
    [2.685, 5.942, 2.685], // 4 bits paired rows, 8 rows: a pass or group of a strip
    [28.982, 41.204, 28.982], // 4 bits paired rows, 8 rows: a chunk of a strip
    [6.760, 8.252, 6.760], // 4 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a call
    [98.937, 217.771, 98.937], // 4 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a chunk of a strip
    [4.226, 5.600, 4.226], // 4 bits paired groups, 4 rows: a column of a strip
    [89.925, 181.283, 89.925], // 4 bits paired groups, 8 rows: a call
    [8.928, 32.831, 8.928], // 4 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a chunk of a strip
    [8.036, 10.249, 8.036], // 4 bits paired groups, 8 rows: a column of a strip
    [75.416, 148.730, 75.416], // 8 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 4 rows: a pass or group of a strip
    [8.311, 11.923, 8.311], // 8 bits single rows, 4 rows: a chunk of a strip
    [5.250, 7.498, 5.250], // 8 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a column of a strip
    [76.514, 155.420, 76.514], // 8 bits single groups, 4 rows: a call
    [7.983, 14.349, 7.983], // 8 bits single groups, 4 rows: a strip
    [26.389, 44.947, 26.389], // 8 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 4 rows: a chunk of a strip
    [5.252, 7.499, 5.252], // 8 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a column of a strip
    [76.685, 157.422, 76.685], // 8 bits paired rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 4 rows: a strip
    [2.804, 5.471, 2.804], // 8 bits paired rows, 4 rows: a pass or group of a strip
    [17.477, 28.202, 17.477], // 8 bits paired rows, 4 rows: a chunk of a strip
    [3.375, 4.878, 3.375], // 8 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a column of a strip
    [88.454, 185.033, 88.454], // 8 bits paired groups, 4 rows: a call
    [6.607, 16.057, 6.607], // 8 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a chunk of a strip
    [4.066, 6.098, 4.066], // 8 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a column of a strip
];
