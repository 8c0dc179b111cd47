//! Written by `cargo xtask fit`: expected instructions, expected cycles, instructions at most.

#[rustfmt::skip]
pub(super) const RATES: &[[f64; 3]] = &[
    [85.715, 150.219, 85.715], // a step, with its operations and its action aside
    [8.999, 14.498, 8.999], // a value of the observation
    [249.540, 397.113, 249.540], // an action
    [96.495, 156.639, 96.495], // a value of the action
    [8.036, 8.026, 8.467], // a value of an array of the action contract
    [60.476, 101.909, 60.476], // a call that runs one operation
    [0.000, 0.000, 60.476], // a call that runs pieces
    [0.000, 0.000, 0.000], // an operation that a poll comes to
    [0.000, 0.000, 388.017], // a piece
    [513.665, 859.069, 513.665], // a linear operation
    [0.000, 0.000, 805.842], // a block of rows of a linear operation that a poll comes to
    [25.962, 38.126, 25.962], // eight values compared by magnitude
    [8.924, 12.656, 8.924], // a value compared by magnitude
    [0.000, 0.000, 0.000], // a block of rows whose order is looked at
    [105.862, 201.204, 105.862], // a linear operation that sets its output up before the rows are added
    [1.536, 3.220, 1.536], // an output set to 0 before the rows are added
    [0.000, 0.786, 0.000], // an output set to its bias before the rows are added
    [118.173, 192.056, 118.173], // a block of rows in order, whole strips
    [75.636, 145.169, 75.636], // a block of rows with sums on the stack
    [141.122, 233.298, 141.122], // a run of rows with sums on the stack
    [45.585, 104.140, 45.585], // eight rows scaled by the assembler
    [10.075, 21.535, 10.075], // a row in order scaled
    [16.530, 25.595, 16.530], // a row with an index scaled
    [527.538, 838.107, 527.538], // a normalization
    [23.998, 31.998, 24.000], // a value normalized
    [498.465, 826.049, 498.465], // a layer norm
    [18.005, 26.751, 18.005], // a value of a layer norm
    [422.348, 717.701, 422.348], // an RMS norm
    [11.749, 20.499, 11.749], // a value of an RMS norm
    [393.895, 625.624, 393.895], // an addition
    [6.002, 7.505, 6.002], // a value added
    [397.430, 631.552, 397.430], // a copy
    [1.000, 3.500, 1.000], // a value copied
    [358.663, 609.382, 358.663], // an LSTM cell
    [125.982, 224.962, 125.999], // an element of an LSTM cell
    [357.764, 607.354, 357.764], // a GRU cell
    [84.931, 148.942, 84.968], // an element of a GRU cell
    [225.073, 376.804, 225.073], // a function's operation
    [5.083, 8.248, 5.802], // an element of relu
    [18.757, 35.812, 28.986], // an element of elu
    [23.834, 48.579, 23.963], // an element of silu
    [30.039, 51.952, 31.741], // an element of gelu
    [27.825, 58.551, 27.963], // an element of gelu_tanh
    [28.933, 55.721, 28.986], // an element of tanh
    [28.915, 55.661, 28.982], // an element of sigmoid
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a group
    [538.510, 945.343, 538.510], // 2 bits single rows prepared: a chunk
    [32.174, 45.882, 32.174], // 2 bits single rows prepared: eight values
    [84.594, 125.095, 84.594], // 2 bits single rows prepared: a vector that zeros fill up
    [1.022, 3.534, 1.022], // 2 bits single rows prepared: a value of such a vector
    [501.288, 847.552, 501.288], // 2 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single groups prepared: a group
    [8.190, 25.330, 8.190], // 2 bits single groups prepared: a chunk
    [34.070, 44.297, 34.070], // 2 bits single groups prepared: eight values
    [91.227, 127.513, 91.227], // 2 bits single groups prepared: a vector that zeros fill up
    [1.067, 3.407, 1.067], // 2 bits single groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a vector
    [513.147, 914.835, 513.147], // 2 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a chunk
    [40.023, 53.782, 40.023], // 2 bits paired rows prepared: eight values
    [86.162, 132.375, 86.162], // 2 bits paired rows prepared: a vector that zeros fill up
    [1.023, 3.468, 1.023], // 2 bits paired rows prepared: a value of such a vector
    [512.268, 905.920, 512.268], // 2 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a chunk
    [41.281, 54.649, 41.281], // 2 bits paired groups prepared: eight values
    [90.353, 105.857, 90.353], // 2 bits paired groups prepared: a vector that zeros fill up
    [1.002, 3.528, 1.002], // 2 bits paired groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a group
    [518.482, 906.599, 518.482], // 3 bits single rows prepared: a chunk
    [32.056, 46.121, 32.056], // 3 bits single rows prepared: eight values
    [86.088, 126.670, 86.088], // 3 bits single rows prepared: a vector that zeros fill up
    [0.996, 3.484, 0.996], // 3 bits single rows prepared: a value of such a vector
    [509.843, 878.138, 509.843], // 3 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single groups prepared: a group
    [7.729, 24.803, 7.729], // 3 bits single groups prepared: a chunk
    [34.057, 44.060, 34.057], // 3 bits single groups prepared: eight values
    [89.048, 121.390, 89.048], // 3 bits single groups prepared: a vector that zeros fill up
    [1.071, 3.405, 1.071], // 3 bits single groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a vector
    [486.317, 876.393, 486.317], // 3 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a chunk
    [39.746, 55.240, 39.746], // 3 bits paired rows prepared: eight values
    [88.268, 134.444, 88.268], // 3 bits paired rows prepared: a vector that zeros fill up
    [0.981, 3.490, 0.981], // 3 bits paired rows prepared: a value of such a vector
    [494.875, 884.632, 494.875], // 3 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a chunk
    [42.049, 56.449, 42.049], // 3 bits paired groups prepared: eight values
    [85.208, 125.139, 85.208], // 3 bits paired groups prepared: a vector that zeros fill up
    [0.998, 3.477, 0.998], // 3 bits paired groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a group
    [514.826, 900.002, 514.826], // 4 bits single rows prepared: a chunk
    [32.210, 45.983, 32.210], // 4 bits single rows prepared: eight values
    [84.832, 126.098, 84.832], // 4 bits single rows prepared: a vector that zeros fill up
    [1.005, 3.500, 1.005], // 4 bits single rows prepared: a value of such a vector
    [497.831, 836.906, 497.831], // 4 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single groups prepared: a group
    [8.019, 25.226, 8.019], // 4 bits single groups prepared: a chunk
    [34.150, 44.439, 34.150], // 4 bits single groups prepared: eight values
    [92.034, 131.071, 92.034], // 4 bits single groups prepared: a vector that zeros fill up
    [1.066, 3.396, 1.066], // 4 bits single groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a vector
    [489.694, 849.682, 489.694], // 4 bits paired rows prepared: a group
    [14.819, 56.002, 14.819], // 4 bits paired rows prepared: a chunk
    [37.535, 51.135, 37.535], // 4 bits paired rows prepared: eight values
    [91.320, 137.221, 91.320], // 4 bits paired rows prepared: a vector that zeros fill up
    [0.972, 3.501, 0.972], // 4 bits paired rows prepared: a value of such a vector
    [508.529, 909.290, 508.529], // 4 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a chunk
    [41.224, 55.093, 41.224], // 4 bits paired groups prepared: eight values
    [85.435, 123.350, 85.435], // 4 bits paired groups prepared: a vector that zeros fill up
    [1.003, 3.510, 1.003], // 4 bits paired groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a group
    [521.549, 915.555, 521.549], // 8 bits single rows prepared: a chunk
    [32.747, 44.614, 32.747], // 8 bits single rows prepared: eight values
    [78.869, 109.337, 78.869], // 8 bits single rows prepared: a vector that zeros fill up
    [1.015, 3.506, 1.015], // 8 bits single rows prepared: a value of such a vector
    [495.961, 831.259, 495.961], // 8 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single groups prepared: a group
    [7.941, 25.437, 7.941], // 8 bits single groups prepared: a chunk
    [34.157, 44.365, 34.157], // 8 bits single groups prepared: eight values
    [92.062, 131.973, 92.062], // 8 bits single groups prepared: a vector that zeros fill up
    [1.067, 3.394, 1.067], // 8 bits single groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a vector
    [495.045, 882.312, 495.045], // 8 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a chunk
    [33.461, 45.732, 33.461], // 8 bits paired rows prepared: eight values
    [84.586, 121.620, 84.586], // 8 bits paired rows prepared: a vector that zeros fill up
    [1.022, 3.583, 1.022], // 8 bits paired rows prepared: a value of such a vector
    [489.843, 879.241, 489.843], // 8 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a chunk
    [36.552, 49.716, 36.552], // 8 bits paired groups prepared: eight values
    [85.284, 125.566, 85.284], // 8 bits paired groups prepared: a vector that zeros fill up
    [0.998, 3.477, 0.998], // 8 bits paired groups prepared: a value of such a vector
    [19.589, 44.827, 19.589], // 2 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 4 rows: a strip
    [3.053, 3.938, 3.053], // 2 bits single rows, 4 rows: a pass or group of a strip
    [16.277, 24.168, 16.277], // 2 bits single rows, 4 rows: a chunk of a strip
    [4.324, 5.143, 4.324], // 2 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a column of a strip
    [43.858, 128.456, 43.858], // 2 bits single groups, 4 rows: a call
    [16.615, 20.080, 16.615], // 2 bits single groups, 4 rows: a strip
    [23.673, 40.618, 23.673], // 2 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 4 rows: a chunk of a strip
    [4.382, 5.283, 4.382], // 2 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a call
    [45.662, 65.579, 45.662], // 2 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a pass or group of a strip
    [17.149, 40.590, 17.149], // 2 bits paired rows, 4 rows: a chunk of a strip
    [2.252, 2.904, 2.252], // 2 bits paired rows, 4 rows: a column of a strip
    [39.307, 85.560, 39.307], // 2 bits paired rows, 8 rows: a call
    [35.996, 30.774, 35.996], // 2 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 8 rows: a pass or group of a strip
    [24.552, 48.138, 24.552], // 2 bits paired rows, 8 rows: a chunk of a strip
    [3.991, 4.902, 3.991], // 2 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a call
    [33.740, 69.647, 33.740], // 2 bits paired groups, 4 rows: a strip
    [12.392, 0.000, 12.392], // 2 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a chunk of a strip
    [2.980, 4.364, 2.980], // 2 bits paired groups, 4 rows: a column of a strip
    [39.022, 83.695, 39.022], // 2 bits paired groups, 8 rows: a call
    [21.310, 19.584, 21.310], // 2 bits paired groups, 8 rows: a strip
    [45.566, 52.813, 45.566], // 2 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a chunk of a strip
    [4.500, 5.961, 4.500], // 2 bits paired groups, 8 rows: a column of a strip
    [39.624, 81.433, 39.624], // 3 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a pass or group of a strip
    [14.971, 21.605, 14.971], // 3 bits single rows, 4 rows: a chunk of a strip
    [5.204, 6.170, 5.204], // 3 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a column of a strip
    [39.125, 111.352, 39.125], // 3 bits single groups, 4 rows: a call
    [14.549, 14.543, 14.549], // 3 bits single groups, 4 rows: a strip
    [23.709, 40.430, 23.709], // 3 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 4 rows: a chunk of a strip
    [5.165, 6.204, 5.165], // 3 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a column of a strip
    [57.539, 109.957, 57.539], // 3 bits paired rows, 4 rows: a call
    [21.786, 23.902, 21.786], // 3 bits paired rows, 4 rows: a strip
    [15.467, 27.260, 15.467], // 3 bits paired rows, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 4 rows: a chunk of a strip
    [2.958, 3.855, 2.958], // 3 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a column of a strip
    [46.730, 93.808, 46.730], // 3 bits paired groups, 4 rows: a call
    [11.077, 8.134, 11.077], // 3 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a chunk of a strip
    [3.656, 5.029, 3.656], // 3 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a column of a strip
    [43.083, 89.388, 43.083], // 4 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 4 rows: a strip
    [3.131, 4.421, 3.131], // 4 bits single rows, 4 rows: a pass or group of a strip
    [16.354, 24.358, 16.354], // 4 bits single rows, 4 rows: a chunk of a strip
    [4.383, 5.438, 4.383], // 4 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a column of a strip
    [45.765, 134.335, 45.765], // 4 bits single groups, 4 rows: a call
    [17.067, 21.343, 17.067], // 4 bits single groups, 4 rows: a strip
    [23.755, 40.806, 23.755], // 4 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 4 rows: a chunk of a strip
    [4.441, 5.588, 4.441], // 4 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a call
    [34.099, 80.068, 34.099], // 4 bits paired rows, 4 rows: a strip
    [0.000, 12.318, 0.000], // 4 bits paired rows, 4 rows: a pass or group of a strip
    [28.946, 0.000, 28.946], // 4 bits paired rows, 4 rows: a chunk of a strip
    [3.583, 4.599, 3.583], // 4 bits paired rows, 4 rows: a column of a strip
    [46.101, 97.068, 46.101], // 4 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits paired rows, 8 rows: a strip
    [13.924, 24.263, 13.924], // 4 bits paired rows, 8 rows: a pass or group of a strip
    [37.131, 30.329, 37.131], // 4 bits paired rows, 8 rows: a chunk of a strip
    [6.287, 7.527, 6.287], // 4 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a call
    [33.369, 62.994, 33.369], // 4 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a chunk of a strip
    [4.367, 5.910, 4.367], // 4 bits paired groups, 4 rows: a column of a strip
    [30.950, 68.118, 30.950], // 4 bits paired groups, 8 rows: a call
    [18.871, 10.501, 18.871], // 4 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a chunk of a strip
    [7.753, 9.970, 7.753], // 4 bits paired groups, 8 rows: a column of a strip
    [26.644, 70.870, 26.644], // 8 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 4 rows: a strip
    [3.370, 6.157, 3.370], // 8 bits single rows, 4 rows: a pass or group of a strip
    [16.630, 22.530, 16.630], // 8 bits single rows, 4 rows: a chunk of a strip
    [4.491, 6.027, 4.491], // 8 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a column of a strip
    [45.675, 138.337, 45.675], // 8 bits single groups, 4 rows: a call
    [17.064, 21.269, 17.064], // 8 bits single groups, 4 rows: a strip
    [23.775, 40.791, 23.775], // 8 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 4 rows: a chunk of a strip
    [4.565, 6.215, 4.565], // 8 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a column of a strip
    [43.384, 92.967, 43.384], // 8 bits paired rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 4 rows: a strip
    [14.531, 24.466, 14.531], // 8 bits paired rows, 4 rows: a pass or group of a strip
    [23.524, 26.392, 23.524], // 8 bits paired rows, 4 rows: a chunk of a strip
    [3.157, 4.526, 3.157], // 8 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a column of a strip
    [44.691, 89.629, 44.691], // 8 bits paired groups, 4 rows: a call
    [11.080, 10.215, 11.080], // 8 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a chunk of a strip
    [4.062, 6.091, 4.062], // 8 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a column of a strip
];
