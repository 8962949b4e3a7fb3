int placeholder_fibre();
