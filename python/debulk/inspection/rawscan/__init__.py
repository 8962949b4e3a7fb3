"""What the filters would hide: standing wrinkles, narrow bumps, filled and smoothed scans."""
